#include "server/report/svg_bars.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/plot/svg_plot.h"
#include "server/report/html_page.h"

namespace strandcast {
namespace {

// Layout in px.
constexpr double kLeft = 64.0;
constexpr double kRight = 12.0;
constexpr double kTop = 66.0;  // title and legend
constexpr double kBottom = 118.0;
constexpr double kLegendY = 46.0;
constexpr double kLegendMark = 11.0;
constexpr double kCharacter = 6.6;  // mean width of a letter
constexpr double kHeadroom = 1.06;  // above the highest bar, for its number
constexpr double kGroupShare = 0.82;

struct Layout {
  double top_value;
  double plot_width;
  double base_px;
  double px_per_unit;

  double y_px(double value) const { return base_px - value * px_per_unit; }
};

double highest(const BarDesc& desc) {
  double value = 0.0;
  for (const BarSeries& series : desc.series)
    for (const double bar : series.value)
      if (std::isfinite(bar)) value = std::max(value, bar);
  return value;
}

std::string scale_svg(const BarDesc& desc, const Layout& layout) {
  std::string svg;
  for (const double tick : plot_ticks(PlotScale::Linear, 0.0, layout.top_value)) {
    svg += fmt::format(
        "<line class=\"grid\" x1=\"{0:.1f}\" x2=\"{1:.1f}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/>"
        "<text x=\"{3:.1f}\" y=\"{4:.1f}\" text-anchor=\"end\">{5:.4g}</text>\n",
        kLeft, kLeft + layout.plot_width, layout.y_px(tick), kLeft - 7.0, layout.y_px(tick) + 4.0, tick);
  }
  const double middle = 0.5 * (kTop + layout.base_px);
  svg +=
      fmt::format("<text class=\"title\" x=\"{:.1f}\" y=\"22\">{}</text>\n", kLeft, html_escaped(desc.title));
  return svg + fmt::format(
                   "<text x=\"16\" y=\"{0:.1f}\" text-anchor=\"middle\" transform=\"rotate(-90 16 {0:.1f})\">"
                   "{1}</text>\n",
                   middle, html_escaped(desc.y_title));
}

std::string legend_svg(const BarDesc& desc) {
  std::string svg;
  double x_px = kLeft;
  for (const BarSeries& series : desc.series) {
    svg += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:g}\" height=\"{:g}\" fill=\"{}\"/><text x=\"{:.1f}\" "
        "y=\"{:.1f}\">{}</text>\n",
        x_px, kLegendY - kLegendMark + 1.0, kLegendMark, kLegendMark, plot_color(series.style),
        x_px + kLegendMark + 5.0, kLegendY, html_escaped(series.name));
    x_px += kLegendMark + 22.0 + kCharacter * static_cast<double>(series.name.size());
  }
  return svg;
}

std::string bars_svg(const BarDesc& desc, const Layout& layout) {
  const double group_px = layout.plot_width / static_cast<double>(desc.groups.size());
  const double bar_px = kGroupShare * group_px / static_cast<double>(desc.series.size());
  constexpr double kNumberWidth = 24.0;  // narrower bars have no number above
  std::string svg;
  for (size_t group = 0; group < desc.groups.size(); ++group) {
    const double begin_px = kLeft + (static_cast<double>(group) + 0.5 * (1.0 - kGroupShare)) * group_px;
    for (size_t i = 0; i < desc.series.size(); ++i) {
      const double value = desc.series[i].value[group];
      if (!std::isfinite(value)) continue;
      const double x_px = begin_px + static_cast<double>(i) * bar_px;
      svg += fmt::format(
          "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\"><title>{}: {:.2f}"
          "</title></rect>\n",
          x_px, layout.y_px(value), 0.92 * bar_px, layout.base_px - layout.y_px(value),
          plot_color(desc.series[i].style), html_escaped(desc.series[i].name), value);
      if (bar_px < kNumberWidth && i != 0) continue;
      svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{:.{}f}</text>\n",
                         x_px + 0.46 * bar_px, layout.y_px(value) - 4.0, value, value < 10.0 ? 1 : 0);
    }
    const double x_px = begin_px + 0.5 * kGroupShare * group_px;
    svg += fmt::format(
        "<text x=\"{0:.1f}\" y=\"{1:.1f}\" text-anchor=\"end\" transform=\"rotate(-32 {0:.1f} {1:.1f})\">{2}"
        "</text>\n",
        x_px + 5.0, layout.base_px + 16.0, html_escaped(desc.groups[group]));
  }
  return svg;
}

}  // namespace

std::string make_svg_bars(const BarDesc& desc) {
  Layout layout{};
  layout.top_value = highest(desc) * kHeadroom;
  layout.plot_width = desc.width - kLeft - kRight;
  layout.base_px = desc.height - kBottom;
  layout.px_per_unit = layout.top_value > 0.0 ? (layout.base_px - kTop) / layout.top_value : 0.0;
  std::string svg = fmt::format(
      "<svg class=\"plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:g} {1:g}\" width=\"{0:g}\" "
      "height=\"{1:g}\" role=\"img\" aria-label=\"{2}\">\n{3}\n",
      desc.width, desc.height, html_escaped(desc.title), plot_style_sheet());
  svg += scale_svg(desc, layout) + legend_svg(desc);
  if (layout.top_value > 0.0)
    svg += bars_svg(desc, layout);
  else
    svg +=
        fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\">nothing was measured</text>\n", kLeft, layout.base_px);
  return svg +
         fmt::format("<rect class=\"frame\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>\n",
                     kLeft, kTop, layout.plot_width, layout.base_px - kTop) +
         "</svg>\n";
}

}  // namespace strandcast
