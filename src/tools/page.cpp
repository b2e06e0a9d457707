#include "page.hpp"

#include <algorithm>
#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "../common/text.hpp"
#include "../data/text_file.hpp"

namespace sdvo {
namespace {

std::string base64(const std::vector<std::uint8_t>& bytes) {
  using Bits = boost::archive::iterators::transform_width<std::vector<std::uint8_t>::const_iterator, 6, 8>;
  using Encoder = boost::archive::iterators::base64_from_binary<Bits>;
  std::string encoded{Encoder(bytes.begin()), Encoder(bytes.end())};
  encoded.append((3 - bytes.size() % 3) % 3, '=');
  return encoded;
}

/// White is no difference, full red 2 px.
std::string cellOf(double dv) {
  if (std::isnan(dv)) return "<td class='n'>-</td>";
  const int other = 255 - static_cast<int>(std::min(std::abs(dv) / 2.0, 1.0) * 200.0);
  return text(2, "<td style='background:rgb(255,", other, ",", other, ")'>", dv, "</td>");
}

constexpr char kStyle[] =
    "body{font:15px sans-serif;max-width:76em;margin:0 auto;padding:0 1em 2em;color:#222}"
    "h1{font-size:1.5em;margin:.8em 0 .3em;overflow-wrap:anywhere}h2{font-size:1.15em;margin:1.6em 0 .5em}"
    ".verdict{color:#fff;padding:.6em .8em;font-size:1.15em;font-weight:bold}.n{color:#666}"
    "table{border-collapse:collapse;display:block;max-width:100%;overflow-x:auto}"
    "td,th{padding:.3em .7em;text-align:left;border-bottom:1px solid "
    "#ddd;vertical-align:top;overflow-wrap:break-word}.v{color:#fff;font-weight:bold}"
    ".wide td{padding:.3em .4em;font-size:.85em}"
    ".when td{white-space:nowrap}.when td:last-child{white-space:normal}"
    ".grid{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,330px),1fr));gap:1em}"
    "figure{margin:0;min-width:0}figcaption{font-size:.85em;margin-bottom:.2em}svg,img{width:100%;display:block}"
    "svg text{font:11px sans-serif;fill:#444}.g{stroke:#e4e4e4;fill:none}.c{fill:none;stroke-width:1.5}"
    ".band{height:1.6em}"
    "@media(max-width:600px){.steps tr{display:block;border-bottom:1px solid #ddd;padding:.3em 0}.steps "
    "th{display:none}"
    ".steps td{display:block;border:0;padding:.1em .4em}.steps .v{display:inline-block}}";

}  // namespace

std::string escaped(const std::string& words) {
  std::string html;
  for (const char c : words) switch (c) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      default:
        html += c;
    }
  return html;
}

const char* colourOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kOk:
      return "#2e7d32";
    case Verdict::kWarn:
      return "#c25400";
    case Verdict::kFail:
      return "#c62828";
    case Verdict::kOpen:
      break;
  }
  return "#757575";
}

std::string dateOf(std::int64_t stamp) {
  const std::time_t seconds = stamp / 1000000000;
  std::tm utc{};
  char words[32];
  std::strftime(words, sizeof words, "%Y-%m-%d %H:%M:%S UTC", gmtime_r(&seconds, &utc));
  return words;
}

Finding worstOf(const std::vector<Finding>& findings) {
  for (const Verdict verdict : {Verdict::kFail, Verdict::kWarn, Verdict::kOk})
    for (const Finding& finding : findings)
      if (finding.verdict == verdict) return finding;
  return {"", Verdict::kOpen, "nothing was judged", ""};
}

std::string pageHead(const std::string& title, Verdict verdict, const std::string& sentence) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  std::ostringstream html;
  html << "<!doctype html><html lang='en'><meta charset='utf-8'><meta name='viewport' "
          "content='width=device-width,initial-scale=1'><title>"
       << escaped(title) << "</title><style>" << kStyle << "</style>\n<h1>" << escaped(title)
       << "</h1>\n<p class='verdict' style='background:" << colourOf(verdict) << "'>" << escaped(sentence)
       << "</p>\n<p class='n'>Written " << dateOf(std::chrono::nanoseconds(now).count()) << " by stereo_descriptor_vo "
       << SDVO_VERSION << "</p>\n";
  return html.str();
}

std::string findingsTable(const std::vector<Finding>& findings) {
  std::ostringstream html;
  html << "<table class='steps'><tr><th>step<th><th>found<th>what to do</tr>\n";
  for (const Finding& finding : findings)
    html << "<tr><td>" << escaped(finding.step) << "<td class='v' style='background:" << colourOf(finding.verdict)
         << "'>" << toString(finding.verdict) << "<td>" << escaped(finding.what) << "<td>" << escaped(finding.remedy)
         << "</tr>\n";
  html << "</table>\n";
  return html.str();
}

std::string rowsTable(const cv::Mat& rows) {
  if (rows.empty()) return "";
  std::ostringstream html;
  html << "<h2>Rows of the right image against the left one, px</h2>\n<div class='wide'><table>";
  for (int row = 0; row < rows.rows; ++row) {
    html << "<tr>";
    for (int column = 0; column < rows.cols; ++column) html << cellOf(rows.at<double>(row, column));
    html << "</tr>\n";
  }
  html << "</table></div>\n<p>As seen in the image; positive: lower in the right image.</p>\n";
  return html.str();
}

std::string wordsTable(const std::vector<std::vector<std::string>>& rows) {
  std::ostringstream html;
  html << "<table>";
  for (const std::vector<std::string>& row : rows) {
    html << "<tr>";
    for (const std::string& words : row) html << "<td>" << escaped(words);
    html << "</tr>\n";
  }
  html << "</table>\n";
  return html.str();
}

std::string picture(const cv::Mat& image, const std::string& words, std::size_t most_bytes) {
  constexpr int kWidest = 640;  // px
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
  return "<figure><img alt='" + escaped(words) + "' src='data:image/jpeg;base64," + encoded + "'><figcaption>" +
         escaped(words) + "</figcaption></figure>\n";
}

void writePage(const std::string& path, const std::string& html) {
  writeTextFile(path, html);
}

}  // namespace sdvo
