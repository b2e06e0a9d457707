#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "../check/finding.hpp"

namespace sdvo {

/// Parts of an HTML page that needs no other file and reads on a narrow screen, too.

/// A word or sentence that holds no tag.
std::string escaped(const std::string& words);

/// The page up to its heading: the name of what was looked at, and the verdict on it in its colour. Below stand the
/// moment of writing and the version of this package.
std::string pageHead(const std::string& title, Verdict verdict, const std::string& sentence);

/// The steps of a camera's check.
std::string findingsTable(const std::vector<Finding>& findings);

/// RowCheck::map() as a table; empty without a map.
std::string rowsTable(const cv::Mat& rows);

/// Words in rows, the first of which are names.
std::string wordsTable(const std::vector<std::vector<std::string>>& rows);

/// CV_8UC1 or CV_8UC3 as a picture with words below. It takes at most `most_bytes` of the page.
std::string picture(const cv::Mat& image, const std::string& words, std::size_t most_bytes);

/// A moment (ns since 1970) as date and time in UTC.
std::string dateOf(std::int64_t stamp);

const char* colourOf(Verdict verdict);

/// The worst verdict, and what its first finding says.
Finding worstOf(const std::vector<Finding>& findings);

/// Throws std::runtime_error that names the file when it cannot be written.
void writePage(const std::string& path, const std::string& html);

}  // namespace sdvo
