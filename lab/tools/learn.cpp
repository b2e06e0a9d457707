// Learns constants of the package from images.
#include "learn.hpp"

#include "../../src/tools/run_tool.hpp"

int main(int argc, char** argv) {
  CLI::App app("Learns constants of the package: size curves of descriptors, field pairs of FREAK");
  app.require_subcommand(1);
  CLI::App* size_curve = app.add_subcommand(
      "size-curve", "Fits the size-from-disparity curve to features followed over sequences in KITTI layout");
  CLI::App* freak_pairs = app.add_subcommand(
      "freak-pairs", "Learns FREAK's 512 field pairs from images and writes them as a C++ initialiser list");
  const sdvo::Learning fit = sdvo::addSizeCurve(*size_curve), choose = sdvo::addFreakPairs(*freak_pairs);
  return sdvo::runTool(app, argc, argv, [&] { return size_curve->parsed() ? fit() : choose(); });
}
