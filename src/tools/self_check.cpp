#include "self_check.hpp"

#include <cmath>
#include <iomanip>
#include <sstream>
#include <vector>

#include "stereo_descriptor_vo/common/se3.hpp"

namespace sdvo {
namespace {

/// Length of a sub-path as a ratio of the distance: the mean is over at least ten sub-paths that do not overlap.
constexpr double kSubPath = 0.1;

/// Distance (m) below which the steps are mostly noise, so that there is no error per metre.
constexpr double kStanding = 0.5;

/// Why a run is no estimate of the whole drive; empty when it is one.
std::string whyIncomplete(const OfflineRun& run, const std::string& name) {
  if (run.pairs() < 2) return name + " has one pair, and so no motion";
  if (run.pairsWithoutPose() == 0 && run.discontinuities() == 0) return "";
  return name + " is LOST: " + std::to_string(run.pairsWithoutPose()) + " of " + std::to_string(run.pairs()) +
         " pairs have no pose and " + std::to_string(run.discontinuities()) + " motions are unknown";
}

void setEnd(SelfCheck& check, const Eigen::Isometry3d& T_one_other) {
  check.end_m = T_one_other.translation().norm();
  check.end_deg = degreesOf(T_one_other.linear());
}

/// All fields but end_m and end_deg.
SelfCheck compare(const std::string& name, const Trajectory& one, const Trajectory& other, double error_by_difference) {
  SelfCheck check;
  check.name = name;
  check.pairs = static_cast<int>(one.size());
  check.distance = distancesTravelled(one).back();
  check.error_by_difference = error_by_difference;
  if (check.distance >= kStanding) check.difference = subPathErrors(one, other, {kSubPath * check.distance}).front();
  return check;
}

SelfCheck without(const std::string& name, const OfflineRun& run, const std::string& problem) {
  SelfCheck check;
  check.name = name;
  check.pairs = run.pairs();
  check.distance = run.distance();
  check.problem = problem;
  return check;
}

}  // namespace

const char* SelfCheck::columns() {
  return "check,pairs,distance_m,end_m,end_deg,sub_path_m,sub_paths,difference_percent,difference_deg_per_m,"
         "error_percent,error_deg_per_m,problem";
}

std::string SelfCheck::row() const {
  std::ostringstream line;
  line << std::setprecision(6) << name << "," << pairs << "," << distance << ",";
  if (!problem.empty()) {
    line << ",,,,,,,,";
  } else {
    line << end_m << "," << end_deg << ",";
    if (difference.count > 0)
      line << difference.length << "," << difference.count << "," << difference.translation_percent << ","
           << difference.rotation_deg_per_m << "," << errorPercent() << "," << errorDegPerM() << ",";
    else
      line << ",,,,,,";
  }
  line << problem;
  return line.str();
}

std::string SelfCheck::text() const {
  if (!problem.empty()) return name + ": no figure, " + problem;
  std::ostringstream sentence;
  sentence << std::setprecision(3) << name << ": ";
  if (difference.count > 0)
    sentence << "error about " << errorPercent() << " % and " << errorDegPerM() << " deg/m over " << difference.length
             << " m; ";
  else
    sentence << "the camera stands; ";
  const bool returns = name == "shuttle";
  const double driven = returns ? 2.0 * distance : distance;
  sentence << (returns ? "back at the start it is off by " : "the two ends are apart by ") << end_m << " m and "
           << end_deg << " deg after " << driven << " m";
  if (difference.count > 0 && driven >= 100.0)
    sentence << " (" << 100.0 * end_m / driven << " m and " << 100.0 * end_deg / driven << " deg per 100 m)";
  return sentence.str();
}

Eigen::Isometry3d shuttleEnd(const Trajectory& out, const Trajectory& back) {
  return (out.front().inverse() * out.back()) * (back.front().inverse() * back.back());
}

SelfCheck checkShuttle(const OfflineRun& out, const OfflineRun& back) {
  const std::string name = "shuttle";
  for (const std::string& problem : {whyIncomplete(out, "the way out"), whyIncomplete(back, "the way back")})
    if (!problem.empty()) return without(name, out, problem);
  const Trajectory forwards = out.poses(), backwards = back.poses();
  SelfCheck check = compare(name, forwards, Trajectory(backwards.rbegin(), backwards.rend()), std::sqrt(0.5));
  setEnd(check, shuttleEnd(forwards, backwards));
  return check;
}

SelfCheck checkHalves(const OfflineRun& whole, const OfflineRun& first, const OfflineRun& second) {
  const std::string name = "halves";
  for (const std::string& problem : {whyIncomplete(whole, "the drive"), whyIncomplete(first, "the first half"),
                                     whyIncomplete(second, "the second half")})
    if (!problem.empty()) return without(name, whole, problem);
  const Trajectory one = first.poses(), other = second.poses();
  SelfCheck check = compare(name, one, other, 0.5);
  setEnd(check, (one.front().inverse() * one.back()).inverse() * (other.front().inverse() * other.back()));
  return check;
}

}  // namespace sdvo
