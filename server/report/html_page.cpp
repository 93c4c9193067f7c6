#include "server/report/html_page.h"

#include <fmt/format.h>

#include "common/base/base64.h"
#include "common/base/check.h"

namespace strandcast {
namespace {

constexpr const char* kStyle = R"(
:root { color-scheme: light dark; --text: #1c2126; --soft: #5b6570; --back: #ffffff; --line: #d8dde2;
  --panel: #f4f6f8; --good: #d7efdc; --bad: #f8d9d6; }
@media (prefers-color-scheme: dark) { :root { --text: #e4e7ea; --soft: #a0a9b2; --back: #14171a;
  --line: #363c43; --panel: #1e2327; --good: #1d4428; --bad: #5a2622; } }
body { color: var(--text); background: var(--back); font: 16px/1.5 system-ui, sans-serif; max-width: 60rem;
  margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; line-height: 1.2; } h2 { font-size: 1.25rem; margin-top: 2.2rem; }
.answer { background: var(--panel); border-left: 4px solid #2a7fb8; padding: .6rem 1rem; }
figure { margin: 1.2rem 0; } figure svg { max-width: 100%; height: auto; }
figcaption, .caption { color: var(--soft); font-size: .9rem; }
.caption { margin-bottom: .3rem; }
.wide { overflow-x: auto; margin: 0 0 1.2rem; }
table { border-collapse: collapse; font-size: .88rem; font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid var(--line); padding: .25rem .7rem .25rem 0; text-align: left;
  vertical-align: top; }
th { color: var(--soft); font-weight: 600; vertical-align: bottom; }
td.number { text-align: right; white-space: nowrap; }
td.good { background: var(--good); } td.bad { background: var(--bad); }
pre { background: var(--panel); padding: .7rem 1rem; overflow-x: auto; font-size: .88rem; }
)";

/// A number, perhaps with a short unit: "12.5", "-3e-07 %", "1.2 ms".
bool looks_like_number(std::string_view text) {
  constexpr size_t kLongest = 14;
  const size_t first = text.find_first_not_of("+-<>= ");
  return first != std::string_view::npos && text[first] >= '0' && text[first] <= '9' &&
         text.size() <= kLongest && text.find(',') == std::string_view::npos;
}

}  // namespace

/// RFC 4648.
HtmlPage::HtmlPage(std::string title) : title_(std::move(title)) {}

void HtmlPage::element(std::string_view tag, std::string_view text) {
  body_ += fmt::format("<{0}>{1}</{0}>\n", tag, html_escaped(text));
}

void HtmlPage::heading(std::string_view text) {
  element("h2", text);
}
void HtmlPage::paragraph(std::string_view text) {
  element("p", text);
}
void HtmlPage::code(std::string_view text) {
  element("pre", text);
}

void HtmlPage::answer(std::string_view text) {
  body_ += fmt::format("<p class=\"answer\">{}</p>\n", html_escaped(text));
}

void HtmlPage::table(const HtmlTable& table) {
  if (!table.caption.empty())
    body_ += fmt::format("<p class=\"caption\">{}</p>\n", html_escaped(table.caption));
  body_ += "<div class=\"wide\"><table>\n";
  body_ += "<tr>";
  for (const std::string& column : table.columns) body_ += fmt::format("<th>{}</th>", html_escaped(column));
  body_ += "</tr>\n";
  for (const std::vector<HtmlCell>& row : table.rows) {
    CHECK(row.size() == table.columns.size());
    body_ += "<tr>";
    for (const HtmlCell& cell : row) {
      std::string classes = looks_like_number(cell.text) ? "number" : "";
      if (cell.mark != HtmlMark::None) classes += cell.mark == HtmlMark::Good ? " good" : " bad";
      body_ += classes.empty() ? "<td>" : fmt::format("<td class=\"{}\">", classes);
      body_ += html_escaped(cell.text) + "</td>";
    }
    body_ += "</tr>\n";
  }
  body_ += "</table></div>\n";
}

void HtmlPage::figure(std::string_view svg, std::string_view caption) {
  body_ += fmt::format("<figure>\n{}<figcaption>{}</figcaption></figure>\n", svg, html_escaped(caption));
}

void HtmlPage::picture(std::span<const std::byte> jpeg, std::string_view caption) {
  body_ += fmt::format(
      "<figure>\n<img style=\"max-width:100%\" alt=\"\" "
      "src=\"data:image/jpeg;base64,{}\"><figcaption>{}</figcaption>"
      "</figure>\n",
      base64_of(jpeg), html_escaped(caption));
}

std::string HtmlPage::text() const {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\">\n<title>{0}</title>\n<style>{1}</style></head>\n"
      "<body>\n<h1>{0}</h1>\n{2}</body></html>\n",
      html_escaped(title_), kStyle, body_);
}

}  // namespace strandcast
