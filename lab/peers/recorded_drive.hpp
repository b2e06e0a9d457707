// Common to all drivers: a drive in KITTI's layout in memory, CPU time of all threads, poses in KITTI's format.
#pragma once
#include <sys/resource.h>
#include <time.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>
#include <vector>

// Images are decoded before the clock starts.
struct RecordedDrive {
  std::vector<cv::Mat> left, right;
  std::vector<double> stamps;                     // s
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  // px, the same for both cameras
  double baseline = 0.0;                          // m
  int width = 0, height = 0;

  explicit RecordedDrive(const std::string& folder) {
    std::ifstream calibration(folder + "/calib.txt");
    std::string line;
    while (std::getline(calibration, line)) {
      std::istringstream words(line);
      std::string name;
      words >> name;
      double projection[12] = {};
      for (double& value : projection) words >> value;
      if (name == "P0:") {
        fx = projection[0];
        fy = projection[5];
        cx = projection[2];
        cy = projection[6];
      } else if (name == "P1:") {
        baseline = -projection[3] / projection[0];
      }
    }
    std::ifstream times(folder + "/times.txt");
    for (double stamp; times >> stamp;) stamps.push_back(stamp);
    for (size_t i = 0; i < stamps.size(); ++i) {
      left.push_back(image(folder + "/image_0", i));
      right.push_back(image(folder + "/image_1", i));
    }
    if (left.empty() || fx == 0.0 || baseline == 0.0) {
      std::fprintf(stderr, "error: %s has no times.txt or no calib.txt with P0 and P1\n", folder.c_str());
      std::exit(2);
    }
    width = left[0].cols;
    height = left[0].rows;
  }

  size_t size() const { return left.size(); }

 private:
  static cv::Mat image(const std::string& folder, size_t number) {
    char name[32];
    std::snprintf(name, sizeof name, "/%06zu.png", number);
    const cv::Mat image = cv::imread(folder + name, cv::IMREAD_GRAYSCALE);
    if (image.empty()) {
      std::fprintf(stderr, "error: %s%s cannot be read\n", folder.c_str(), name);
      std::exit(2);
    }
    return image;
  }
};

inline double seconds(clockid_t clock) {
  timespec time;
  clock_gettime(clock, &time);
  return time.tv_sec + 1e-9 * time.tv_nsec;
}

// Of all threads of the process.
inline double cpuSeconds() {
  return seconds(CLOCK_PROCESS_CPUTIME_ID);
}

inline double wallSeconds() {
  return seconds(CLOCK_MONOTONIC);
}

// element(row, column) of T_first_current, left optical frame.
template <class Element>
void writePose(FILE* file, Element element) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      std::fprintf(file, "%.9g%c", static_cast<double>(element(row, column)), row == 2 && column == 3 ? '\n' : ' ');
    }
  }
}

inline FILE* openToWrite(const char* path) {
  FILE* file = std::fopen(path, "w");
  if (!file) {
    std::perror(path);
    std::exit(2);
  }
  return file;
}

// `cpu` and `wall` in s for all pairs; `lost` pairs have no motion.
inline void report(const char* name, size_t pairs, double cpu, double wall, int lost) {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  std::printf("%s: %zu pairs, %d lost, CPU %.2f ms and %.2f ms of the clock a pair, %.0f MB\n", name, pairs, lost,
              1e3 * cpu / pairs, 1e3 * wall / pairs, usage.ru_maxrss / 1024.0);
}
