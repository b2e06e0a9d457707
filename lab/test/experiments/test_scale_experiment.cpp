#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "../../../test/temporary_folder.hpp"
#include "../../experiments/scale_experiment.hpp"
#include "wall_drive.hpp"

namespace sdvo::test_scale_experiment {

/// Geometric means of neighbours part the scale changes 1, 1.5, 2, 3, 4.
TEST(ScaleExperiment, AFeatureCountsForTheNearestScaleChange) {
  for (const auto& [scale, index] : {std::pair(1.0, 0),
                                     {1.22, 0},
                                     {1.23, 1},
                                     {1.72, 1},
                                     {1.74, 2},
                                     {2.44, 2},
                                     {2.46, 3},
                                     {3.46, 3},
                                     {3.47, 4},
                                     {4.6, 4}})
    EXPECT_EQ(scaleIndex(scale), index) << scale;
  for (const auto& [scale, index] : {std::pair(0.8, -1), {0.9, 0}, {4.9, -1}})
    EXPECT_EQ(scaleIndex(scale), index) << scale << ": what shrinks or grows more counts for none";
}

/// Rows of a CSV file by the names of its columns.
std::vector<std::map<std::string, std::string>> readTable(const std::string& path) {
  std::ifstream file(path);
  const auto cells = [&] {
    std::string line, cell;
    std::getline(file, line);
    std::vector<std::string> found;
    for (std::istringstream rest(line); std::getline(rest, cell, ',');) found.push_back(cell);
    return found;
  };
  const std::vector<std::string> names = cells();
  std::vector<std::map<std::string, std::string>> rows;
  for (auto row = cells(); row.size() == names.size(); row = cells()) {
    rows.emplace_back();
    for (std::size_t k = 0; k < names.size(); ++k) rows.back()[names[k]] = row[k];
  }
  return rows;
}

TEST(ScaleExperiment, SizesByDepthFindMoreOfAWallAtHalfTheDistanceThanConstantOnes) {
  const TemporaryFolder folder;
  ExperimentSetup setup;
  setup.sequences = {(folder.path() / "wall").string()};
  setup.output = folder.path().string();
  setup.reference = ReferenceMotion::kGroundTruth;
  synthetic::writeWallDrive(setup.sequences.front(), 6, 0.8);
  ScaleExperiment experiment;
  experiment.features = 200;
  experiment.steps = {5};
  runScaleChange(setup, experiment);
  std::map<std::string, double> visible, percent;
  for (auto& row : readTable(setup.output + "/scale_change.csv")) {
    if (std::stod(row["scale"]) != 2.0) {
      EXPECT_EQ(std::stod(row["visible"]), 0.0) << "all of the wall is twice as large";
      continue;
    }
    visible[row["method"]] = std::stod(row["visible"]);
    percent[row["method"]] = std::stod(row["percent"]);
  }
  EXPECT_EQ(visible["freak by depth"], visible["freak constant"]) << "the same corners";
  EXPECT_GT(visible["freak by depth"], 30.0) << "about a quarter of 200 stays in view";
  EXPECT_GT(percent["freak by depth"], 50.0);
  EXPECT_LT(percent["freak constant"], 10.0) << "a pattern of 7 px covers another part of the wall";
}

}  // namespace sdvo::test_scale_experiment
