#include "app/files/golden_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/files/output_file.h"
#include "app/files/text.h"

namespace medulla {

namespace {

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Golden images</title>
<style>
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em; color: #222; background: #fafafa; }
table { border-collapse: collapse; margin: 1em 0; background: #fff; }
th, td { text-align: left; padding: .3em .8em; border-bottom: 1px solid #ddd; vertical-align: top; }
.failed { color: #b00020; font-weight: 600; }
.passed { color: #1b6e2c; }
.pictures { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 1em; }
figure { margin: 0; }
img { width: 100%; display: block; background: #000; }
figcaption { color: #555; font-size: 13px; padding: .2em 0; }
</style></head><body>
)";

// The fourth picture borrows the sources of the first two, so that each is in the file once.
constexpr const char* kTail = R"(<script>
for (const box of document.querySelectorAll('.pictures')) {
  const [expected, actual, , flicker] = box.querySelectorAll('img');
  if (!flicker) continue;
  const caption = box.querySelector('figcaption.flicker'), idle = caption.textContent;
  let timer = 0, second = false;
  const show = () => {
    flicker.src = (second ? actual : expected).src;
    caption.textContent = second ? 'actual' : 'expected';
    second = !second;
  };
  flicker.src = expected.src;
  flicker.onmouseenter = () => { second = true; show(); timer = setInterval(show, 400); };
  flicker.onmouseleave = () => { clearInterval(timer); flicker.src = expected.src; caption.textContent = idle; };
}
</script></body></html>
)";

std::string base64(std::string_view bytes) {
  constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < count ? static_cast<std::uint8_t>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += k <= count ? digits[group >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

std::string figure(const Image& image, const std::string& caption) {
  return fmt::format(
      "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>\n", caption,
      base64(encodePng(image)));
}

bool hasPictures(const GoldenResult& r) {
  return !r.expected.pixels.empty() || !r.actual.pixels.empty();
}

std::string row(const GoldenResult& r) {
  const std::string name =
      !hasPictures(r) ? escapedXml(r.name) : fmt::format("<a href=\"#{0}\">{0}</a>", escapedXml(r.name));
  return fmt::format("<tr><td>{}</td><td class=\"{}\">{}</td><td>{}</td><td>{}<br>{}</td></tr>\n", name,
                     r.passed ? "passed" : "failed", r.passed ? "ok" : "failed", escapedXml(r.verdict),
                     escapedXml(r.stored.renderer), escapedXml(r.stored.processor));
}

std::string pictures(const GoldenResult& r) {
  std::string out;
  if (!r.expected.pixels.empty()) out += figure(r.expected, "expected");
  if (!r.actual.pixels.empty()) out += figure(r.actual, "actual");
  if (!hasDifference(r)) return out;
  out += figure(amplifiedDifference(r.actual, r.expected, kGain), fmt::format("difference, {} times", kGain));
  return out +
         "<figure><img alt=\"flicker\"><figcaption class=\"flicker\">expected; under the mouse it flickers with "
         "the actual one</figcaption></figure>\n";
}

}  // namespace

bool hasDifference(const GoldenResult& r) {
  return !r.expected.pixels.empty() && r.expected.width == r.actual.width && r.expected.height == r.actual.height;
}

void writeGoldenReport(const std::string& path, const std::vector<GoldenResult>& results, const DrawnWith& now) {
  const auto failed = std::count_if(results.begin(), results.end(), [](const GoldenResult& r) { return !r.passed; });
  OutputFile file(path);
  file.write(kHead);
  file.write(fmt::format("<h1>{}</h1>\n<p>Drawn with {}<br>on {}</p>\n",
                         failed > 0 ? fmt::format("{} of {} golden images failed", failed, results.size())
                                    : fmt::format("{} golden images passed", results.size()),
                         escapedXml(now.renderer), escapedXml(now.processor)));
  file.write("<table><tr><th>moment</th><th></th><th>difference</th><th>stored with</th></tr>\n");
  for (const GoldenResult& r : results) file.write(row(r));
  file.write("</table>\n");
  for (const GoldenResult& r : results) {
    if (!hasPictures(r)) continue;
    file.write(
        fmt::format("<h2 id=\"{0}\">{0} <span class=\"{1}\">{2}</span></h2>\n<p>{3}<br>{4}</p>\n"
                    "<div class=\"pictures\">\n",
                    escapedXml(r.name), r.passed ? "passed" : "failed", r.passed ? "ok" : "failed", escapedXml(r.scene),
                    escapedXml(r.verdict)));
    file.write(pictures(r));
    file.write("</div>\n");
  }
  file.write(kTail);
  file.commit();
}

}  // namespace medulla
