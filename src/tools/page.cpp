#include "page.hpp"

#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "../common/text.hpp"
#include "../data/text_file.hpp"
#include "page_template.hpp"

namespace sdvo {
namespace {

std::string base64(const std::vector<std::uint8_t>& bytes) {
  using Bits = boost::archive::iterators::transform_width<std::vector<std::uint8_t>::const_iterator, 6, 8>;
  using Encoder = boost::archive::iterators::base64_from_binary<Bits>;
  std::string encoded{Encoder(bytes.begin()), Encoder(bytes.end())};
  encoded.append((3 - bytes.size() % 3) % 3, '=');
  return encoded;
}

}  // namespace

std::string quoted(const std::string& words) {
  std::string json = "\"";
  for (const char c : words) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\' || c == '<' || code < 0x20) {
      char escape[7];
      std::snprintf(escape, sizeof escape, "\\u%04x", code);
      json += escape;
    } else {
      json += c;
    }
  }
  return json + "\"";
}

std::string number(double value, int digits) {
  return std::isfinite(value) ? text(digits, value) : "null";
}

std::string objectOf(const JsonMembers& members) {
  std::string object = "{";
  for (const auto& [name, value] : members) object += (object.size() > 1 ? ",\n" : "") + quoted(name) + ":" + value;
  return object + "}";
}

std::string tableOf(const std::vector<Words>& rows) {
  return listOf(rows, [](const Words& row) { return listOf(row, quoted); });
}

std::string pictureOf(const cv::Mat& image, const std::string& words, std::size_t most_bytes) {
  constexpr int kWidest = 960;  // px
  cv::Mat shown = image;
  if (image.cols > kWidest)
    cv::resize(image, shown, {kWidest, image.rows * kWidest / image.cols}, 0, 0, cv::INTER_AREA);
  std::vector<std::uint8_t> jpeg;
  std::string encoded;
  for (int quality = 85; quality >= 25; quality -= 15) {
    cv::imencode(".jpg", shown, jpeg, {cv::IMWRITE_JPEG_QUALITY, quality});
    encoded = base64(jpeg);
    if (encoded.size() <= most_bytes) break;
  }
  return "[" + quoted(words) + ",\"" + encoded + "\"]";
}

std::string dateOf(std::int64_t stamp) {
  const std::time_t seconds = stamp / 1000000000;
  std::tm utc{};
  char words[32];
  std::strftime(words, sizeof words, "%Y-%m-%d %H:%M:%S UTC", gmtime_r(&seconds, &utc));
  return words;
}

void writePage(const std::string& path, const std::string& title, const Finding& verdict,
               const std::vector<CheckStep>& steps, const cv::Mat& rows, JsonMembers more) {
  std::vector<Words> findings;
  for (const auto& [name, finding] : steps)
    findings.push_back({name, toString(finding.verdict), finding.what, finding.remedy});
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const std::string written =
      dateOf(std::chrono::nanoseconds(now).count()) + " by stereo_descriptor_vo " + SDVO_VERSION;
  std::vector<std::vector<double>> map;
  for (int row = 0; row < rows.rows; ++row) map.push_back(rows.row(row));
  const JsonMembers members = {{"title", quoted(title)},
                               {"verdict", listOf(Words{toString(verdict.verdict), verdict.what}, quoted)},
                               {"written", quoted(written)},
                               {"findings", tableOf(findings)},
                               {"rows", listOf(map, [](const std::vector<double>& row) {
                                  return listOf(row, [](double dv) { return number(dv, 2); });
                                })}};
  more.insert(more.begin(), members.begin(), members.end());
  std::string html = kPageTemplate;
  const std::string mark = "@DATA@";
  html.replace(html.find(mark), mark.size(), objectOf(more));
  writeTextFile(path, html);
}

}  // namespace sdvo
