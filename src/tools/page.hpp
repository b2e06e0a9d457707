#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <vector>

#include "../check/finding.hpp"

namespace sdvo {

/// The JSON object that page.html draws: its parts, and how it becomes a file.

/// Words as a JSON string, which may stand in a script of HTML.
std::string quoted(const std::string& words);

/// With `digits` after the point; null for what is no number.
std::string number(double value, int digits);

/// A JSON list of what `toJson` makes of each item.
template <class Items, class ToJson>
std::string listOf(const Items& items, const ToJson& toJson) {
  std::string list = "[";
  for (const auto& item : items) list += (list.size() > 1 ? "," : "") + toJson(item);
  return list + "]";
}

/// Members of a JSON object by their names.
using JsonMembers = std::vector<std::pair<std::string, std::string>>;
std::string objectOf(const JsonMembers& members);

using Words = std::vector<std::string>;
std::string tableOf(const std::vector<Words>& rows);

/// CV_8UC1 or CV_8UC3 as a JPEG with words. It takes at most `most_bytes` of the page.
std::string pictureOf(const cv::Mat& image, const std::string& words, std::size_t most_bytes);

/// A moment (ns since 1970) as date and time in UTC.
std::string dateOf(std::int64_t stamp);

/// Writes a page that needs no other file, with `more` members of its JSON object. `rows`: RowCheck::map(). Throws
/// std::runtime_error that names the file if it cannot be written.
void writePage(const std::string& path, const std::string& title, const Finding& verdict,
               const std::vector<CheckStep>& steps, const cv::Mat& rows, JsonMembers more);

}  // namespace sdvo
