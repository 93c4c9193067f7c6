// HtmlPage: a self-contained page of a report with text, tables and inline SVG, in light and dark mode,
// without scripts or external resources. Any thread.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/plot/svg_plot.h"

namespace strandcast {

enum class HtmlMark { None, Good, Bad };

struct HtmlCell {
  HtmlCell(std::string cell_text, HtmlMark cell_mark = HtmlMark::None)
      : text(std::move(cell_text)), mark(cell_mark) {}
  HtmlCell(const char* cell_text) : text(cell_text) {}

  std::string text;
  HtmlMark mark = HtmlMark::None;
};

struct HtmlTable {
  std::string caption;
  std::vector<std::string> columns;
  std::vector<std::vector<HtmlCell>> rows;  // as long as `columns`; cells that begin like numbers align right
};

class HtmlPage {
 public:
  explicit HtmlPage(std::string title);

  /// Starts a section; further calls add to it. Text is escaped.
  void heading(std::string_view text);
  void paragraph(std::string_view text);
  /// Adds a highlighted paragraph with the answer to a reader's question.
  void answer(std::string_view text);
  /// Adds lines to copy in a fixed-width font.
  void code(std::string_view text);
  void table(const HtmlTable& table);
  /// Adds a figure; `svg` comes from make_svg_plot() and is not escaped.
  void figure(std::string_view svg, std::string_view caption);

  /// Adds a JPEG, which is embedded in the page.
  void picture(std::span<const std::byte> jpeg, std::string_view caption);

  /// Returns the whole page.
  std::string text() const;

 private:
  void element(std::string_view tag, std::string_view text);

  std::string title_;
  std::string body_;
};

}  // namespace strandcast
