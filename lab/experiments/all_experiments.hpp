#pragma once

#include <string>
#include <vector>

namespace sdvo {

/// Everything that docs/experiments.md shows.
struct AllExperiments {
  std::string kitti;      ///< directory of the KITTI odometry data: sequences/01, 04, 06 and all of poses/
  std::string karlsruhe;  ///< the same of Karlsruhe 2010_03_09_drive_0019 as sequence 19; empty: left out
  std::string euroc;      ///< holds MH_01_half (KITTI layout) and MH_01_moving (ASL layout); empty: left out
  std::string output;     ///< directory for drives, CSV files, pictures and tables.md
  int jobs = 2;           ///< programs that run at a time
  std::string only;       ///< one of experimentNames(); empty: all of them
};

/// The experiments that can be run alone.
const std::vector<std::string>& experimentNames();

/// Renders the drives that `output`/drives lacks, runs the experiments, each in a program of its own, and writes their
/// tables to tables.md; returns its text. Throws std::runtime_error that names the log of a program that failed.
std::string runAll(const AllExperiments& all);

}  // namespace sdvo
