#include "check_page.hpp"

#include "page.hpp"

namespace sdvo {

void writeCheckPage(const std::string& path, const std::string& camera, const std::vector<Finding>& findings,
                    const cv::Mat& rows, const cv::Mat& pair) {
  const Finding worst = worstOf(findings);
  const std::string sentence = worst.verdict == Verdict::kOk
                                   ? "OK: every step that this recording shows"
                                   : std::string(toString(worst.verdict)) + ", " + worst.step + ": " + worst.what;
  std::string html =
      pageHead("Stereo camera " + camera, worst.verdict, sentence) + findingsTable(findings) + rowsTable(rows);
  constexpr std::size_t kMostBytes = 1000000;
  if (!pair.empty()) html += "<h2>A pair</h2>\n" + picture(pair, "left above right", kMostBytes);
  writePage(path, html);
}

}  // namespace sdvo
