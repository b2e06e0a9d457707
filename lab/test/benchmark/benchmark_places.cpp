// Times what the recognition of places costs as the map grows.
#include <benchmark/benchmark.h>

#include "../../../src/places/place_index.hpp"
#include "../../../src/places/place_verifier.hpp"
#include "../../../test/synthetic_scene.hpp"
#include "stereo_descriptor_vo/places/pose_graph.hpp"

namespace {

constexpr int kFeatures = 500;

/// Rows whose bits are as uneven as those of FREAK: some are nearly always the same.
sdvo::StereoFeatures unevenRows(unsigned seed) {
  static const std::vector<double> shares = [] {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0.1, 0.9);
    std::vector<double> values(8 * 128);
    for (double& value : values) value = uniform(random);
    return values;
  }();
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  sdvo::StereoFeatures features = sdvo::synthetic::noFeatures(sdvo::synthetic::camera());
  for (int i = 0; i < kFeatures; ++i) {
    std::vector<std::uint8_t> row(128, 0);
    for (std::size_t bit = 0; bit < shares.size(); ++bit)
      row[bit / 8] = static_cast<std::uint8_t>(row[bit / 8] | (uniform(random) < shares[bit]) << (bit % 8));
    sdvo::synthetic::addFeature(features, 100.0, 100.0, 5.0, row);
  }
  return features;
}

/// Signatures of places drawn from the words of a few hundred ones, as frequent as there.
class Signatures {
 public:
  explicit Signatures(const sdvo::PlaceIndex& index) {
    for (unsigned place = 0; place < 300; ++place)
      for (const std::uint32_t word : index.signature(unevenRows(place))) words_.push_back(word);
  }
  sdvo::PlaceSignature next() {
    sdvo::PlaceSignature signature;
    for (int i = 0; i < 4 * kFeatures; ++i) signature.push_back(words_[random_() % words_.size()]);
    std::sort(signature.begin(), signature.end());
    signature.erase(std::unique(signature.begin(), signature.end()), signature.end());
    return signature;
  }

 private:
  std::vector<std::uint32_t> words_;
  std::mt19937 random_{1};
};

void findPlace(benchmark::State& state) {
  sdvo::PlaceIndex index;
  Signatures signatures(index);
  for (int place = 0; place < state.range(0); ++place) index.add(place, signatures.next());
  const sdvo::PlaceSignature asked = signatures.next();
  for (auto _ : state) benchmark::DoNotOptimize(index.find(asked, 3, [](int) { return true; }));
}

void signature(benchmark::State& state) {
  const sdvo::PlaceIndex index;
  const sdvo::StereoFeatures features = unevenRows(1);
  for (auto _ : state) benchmark::DoNotOptimize(index.signature(features));
}

void verifyAnotherPlace(benchmark::State& state) {
  const sdvo::PlaceVerifier verifier;
  const sdvo::StereoFeatures here = unevenRows(1), there = unevenRows(2);
  for (auto _ : state) benchmark::DoNotOptimize(verifier.verify(there, here));
}

/// A square of streets driven again and again, with loops to the round before.
sdvo::PoseGraph streets(int nodes, int loops) {
  constexpr int kAround = 400;
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0.0, 1.0);
  const auto truth = [](int k) {
    const double angle = 2.0 * M_PI * k / kAround;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
    T.translation() = 190.0 * Eigen::Vector3d(1.0 - std::cos(angle), 0.0, std::sin(angle));
    return T;
  };
  const auto edge = [&](int from, int to, sdvo::GraphEdge::Kind kind, double sigma) {
    sdvo::GraphEdge made;
    made.from = from;
    made.to = to;
    made.kind = kind;
    sdvo::Vector6d xi;
    for (int i = 0; i < 6; ++i) xi[i] = (i < 3 ? sigma : 0.02 * sigma) * normal(random);
    made.T_from_to = truth(from).inverse() * truth(to) * sdvo::expSE3(xi);
    made.covariance = sigma * sigma * sdvo::Matrix6d::Identity();
    made.covariance.bottomRightCorner<3, 3>() *= 4e-4;
    return made;
  };
  sdvo::PoseGraph graph;
  graph.start(0, truth(0));
  for (int k = 1; k < nodes; ++k) graph.extend(edge(k - 1, k, sdvo::GraphEdge::Kind::kOdometry, 0.05));
  for (int k = 0; k < loops; ++k) {
    const int to = kAround + static_cast<int>((nodes - kAround - 1.0) * k / loops);
    graph.close(edge(to - kAround, to, sdvo::GraphEdge::Kind::kLoop, 0.03));
  }
  return graph;
}

/// Of a graph that was optimal until one more loop was found, as each loop finds it.
void optimiseAfterALoop(benchmark::State& state) {
  sdvo::PoseGraph graph = streets(static_cast<int>(state.range(0)), 500);
  graph.optimise();
  sdvo::GraphEdge loop = graph.edges().back();
  loop.from += 3;
  loop.T_from_to = graph.nodes().at(loop.from).inverse() * graph.nodes().at(loop.to);
  loop.T_from_to.translation().x() += 0.3;
  graph.close(loop);
  for (auto _ : state) {
    sdvo::PoseGraph copy = graph;
    benchmark::DoNotOptimize(copy.optimise());
  }
}

void nodesNearAnother(benchmark::State& state) {
  const sdvo::PoseGraph graph = streets(static_cast<int>(state.range(0)), 500);
  for (auto _ : state) benchmark::DoNotOptimize(graph.near(static_cast<int>(state.range(0)) / 2, 20.0));
}

void optimiseFromOdometry(benchmark::State& state) {
  const sdvo::PoseGraph graph = streets(static_cast<int>(state.range(0)), 500);
  for (auto _ : state) {
    sdvo::PoseGraph copy = graph;
    benchmark::DoNotOptimize(copy.optimise());
  }
}

BENCHMARK(signature)->Unit(benchmark::kMillisecond);
BENCHMARK(findPlace)->Arg(100)->Arg(1000)->Arg(10000)->Unit(benchmark::kMillisecond);
BENCHMARK(verifyAnotherPlace)->Unit(benchmark::kMillisecond);
BENCHMARK(nodesNearAnother)->Arg(1000)->Arg(10000)->Unit(benchmark::kMillisecond);
BENCHMARK(optimiseAfterALoop)->Arg(1000)->Arg(10000)->Unit(benchmark::kMillisecond);
BENCHMARK(optimiseFromOdometry)->Arg(1000)->Arg(10000)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
