#include "common/plot/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace strandcast {
namespace {

// Layout in px.
constexpr double kLeft = 76.0;
constexpr double kRight = 190.0;  // the legend
constexpr double kTop = 38.0;
constexpr double kBottom = 56.0;
constexpr double kLegendStep = 19.0;
constexpr double kMarkRadius = 3.6;
constexpr double kTickLabelGap = 7.0;

// Readable on white and on near-black (contrast of at least 3 to 1 with both).
constexpr std::array kColors = {"#d5402b", "#2a7fb8", "#2f9457", "#b27a00", "#8f63c9", "#c9558f",
                                "#4c8f96", "#7d7f85", "#a8643c", "#6a78d6", "#86882a", "#b458c4"};
constexpr size_t kShapeCount = 4;

// Room at both ends of an axis, as a share of its length.
constexpr double kMargin = 0.04;
// Below so many decades a logarithmic axis also labels 2 and 5.
constexpr double kFewDecades = 2.5;
constexpr double kManyDecades = 9.0;

constexpr const char* kStyle =
    "<style>.plot text{font:12px system-ui,sans-serif;fill:#30363c}.plot .title{font-size:14px;"
    "font-weight:600}.plot .grid{stroke:#d8dde2;stroke-width:1}.plot .frame{stroke:#7b858f;fill:none}"
    ".plot .guide{stroke:#7b858f;stroke-dasharray:5 4}.plot .line{fill:none;stroke-width:1.8}"
    ".plot .faint{opacity:.3}@media (prefers-color-scheme:dark){.plot text{fill:#d5d9dd}"
    ".plot .grid{stroke:#363c43}}</style>";

struct Axis {
  PlotScale scale;
  double minimum;  // of the shown range, in the axis's own measure (log10 or the value)
  double maximum;
  double begin_px;
  double end_px;

  double measure(double value) const { return scale == PlotScale::Logarithmic ? std::log10(value) : value; }
  bool can_show(double value) const {
    return std::isfinite(value) && (scale == PlotScale::Linear || value > 0.0);
  }
  double pixel(double value) const {
    const double share = std::clamp((measure(value) - minimum) / (maximum - minimum), 0.0, 1.0);
    return begin_px + share * (end_px - begin_px);
  }
};

Axis make_axis(const PlotAxis& desc, const std::vector<double>& values, double begin_px, double end_px) {
  Axis axis{desc.scale, INFINITY, -INFINITY, begin_px, end_px};
  for (const double value : values) {
    if (!axis.can_show(value)) continue;
    axis.minimum = std::min(axis.minimum, axis.measure(value));
    axis.maximum = std::max(axis.maximum, axis.measure(value));
  }
  if (!(axis.minimum <= axis.maximum)) axis.minimum = axis.maximum = 0.0;
  const double narrow = axis.scale == PlotScale::Logarithmic ? 0.5 : std::max(0.5, std::abs(axis.minimum));
  if (axis.maximum - axis.minimum < 1e-9 * narrow) {
    axis.minimum -= narrow;
    axis.maximum += narrow;
  }
  const double margin = kMargin * (axis.maximum - axis.minimum);
  const bool has_minimum = axis.can_show(desc.minimum);
  const bool has_maximum = axis.can_show(desc.maximum);
  axis.minimum = has_minimum ? axis.measure(desc.minimum) : axis.minimum - margin;
  axis.maximum = has_maximum ? axis.measure(desc.maximum) : axis.maximum + margin;
  if (!(axis.minimum < axis.maximum)) axis.maximum = axis.minimum + 1.0;
  return axis;
}

double shown(const Axis& axis, double measure) {
  return axis.scale == PlotScale::Logarithmic ? std::pow(10.0, measure) : measure;
}

std::vector<double> ticks_of(const Axis& axis) {
  return plot_ticks(axis.scale, shown(axis, axis.minimum), shown(axis, axis.maximum));
}

/// Attributes of a series' line; dashed once the colours begin again.
std::string stroke_of(size_t style) {
  return fmt::format(" stroke=\"{}\"{}", kColors[style % kColors.size()],
                     style < kColors.size() ? "" : " stroke-dasharray=\"7 4\"");
}

std::string mark_svg(size_t style, double x, double y, const std::string& note) {
  const char* color = kColors[style % kColors.size()];
  const std::string title = note.empty() ? "" : fmt::format("<title>{}</title>", html_escaped(note));
  const double r = kMarkRadius;
  const auto polygon = [&](std::initializer_list<std::pair<double, double>> corners) {
    std::string points;
    for (const auto& [dx, dy] : corners) points += fmt::format("{:.2f},{:.2f} ", x + dx * r, y + dy * r);
    return fmt::format("<polygon points=\"{}\" fill=\"{}\">{}</polygon>\n", points, color, title);
  };
  switch ((style / kColors.size() + style) % kShapeCount) {
    case 0:
      return fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" fill=\"{}\">{}</circle>\n", x, y,
                         r, color, title);
    case 1:
      return polygon({{-0.9, -0.9}, {0.9, -0.9}, {0.9, 0.9}, {-0.9, 0.9}});
    case 2:
      return polygon({{0.0, -1.25}, {1.15, 0.9}, {-1.15, 0.9}});
    default:
      return polygon({{0.0, -1.35}, {1.35, 0.0}, {0.0, 1.35}, {-1.35, 0.0}});
  }
}

std::string series_svg(const PlotSeries& series, size_t style, const Axis& x, const Axis& y) {
  std::string line;
  std::string marks;
  for (const PlotPoint& point : series.points) {
    if (!x.can_show(point.x) || !y.can_show(point.y)) continue;
    const double x_px = x.pixel(point.x);
    const double y_px = y.pixel(point.y);
    line += fmt::format("{}{:.2f} {:.2f}", line.empty() ? "M" : "L", x_px, y_px);
    marks += mark_svg(style, x_px, y_px, point.note);
  }
  std::string svg = series.is_faint ? "<g class=\"faint\">\n" : "<g>\n";
  if (series.mark != PlotMark::Dots && !line.empty())
    svg += fmt::format("<path class=\"line\" d=\"{}\"{}/>\n", line, stroke_of(style));
  if (series.mark != PlotMark::Line) svg += marks;
  return svg + "</g>\n";
}

std::string axes_svg(const PlotDesc& desc, const Axis& x, const Axis& y) {
  std::string svg;
  for (const double tick : ticks_of(x)) {
    const double at = x.pixel(tick);
    svg += fmt::format(
        "<line class=\"grid\" x1=\"{0:.2f}\" x2=\"{0:.2f}\" y1=\"{1:.2f}\" y2=\"{2:.2f}\"/>"
        "<text x=\"{0:.2f}\" y=\"{3:.2f}\" text-anchor=\"middle\">{4:.4g}</text>\n",
        at, y.end_px, y.begin_px, y.begin_px + 12.0 + kTickLabelGap, tick);
  }
  for (const double tick : ticks_of(y)) {
    const double at = y.pixel(tick);
    svg += fmt::format(
        "<line class=\"grid\" x1=\"{1:.2f}\" x2=\"{2:.2f}\" y1=\"{0:.2f}\" y2=\"{0:.2f}\"/>"
        "<text x=\"{3:.2f}\" y=\"{4:.2f}\" text-anchor=\"end\">{5:.4g}</text>\n",
        at, x.begin_px, x.end_px, x.begin_px - kTickLabelGap, at + 4.0, tick);
  }
  svg += fmt::format("<rect class=\"frame\" x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\"/>\n",
                     x.begin_px, y.end_px, x.end_px - x.begin_px, y.begin_px - y.end_px);
  svg += fmt::format("<text class=\"title\" x=\"{:.2f}\" y=\"{:.2f}\">{}</text>\n", x.begin_px, kTop - 16.0,
                     html_escaped(desc.title));
  svg += fmt::format("<text x=\"{:.2f}\" y=\"{:.2f}\" text-anchor=\"middle\">{}</text>\n",
                     0.5 * (x.begin_px + x.end_px), desc.height - 12.0, html_escaped(desc.x.title));
  const double middle = 0.5 * (y.begin_px + y.end_px);
  svg += fmt::format(
      "<text x=\"16\" y=\"{0:.2f}\" text-anchor=\"middle\" transform=\"rotate(-90 16 {0:.2f})\">{1}</text>\n",
      middle, html_escaped(desc.y.title));
  return svg;
}

std::string guides_svg(const PlotDesc& desc, const Axis& x, const Axis& y) {
  std::string svg;
  for (const PlotGuide& guide : desc.guides) {
    if (!y.can_show(guide.y)) continue;
    const double at = y.pixel(guide.y);
    svg += fmt::format(
        "<line class=\"guide\" x1=\"{0:.2f}\" x2=\"{1:.2f}\" y1=\"{2:.2f}\" y2=\"{2:.2f}\"/>"
        "<text x=\"{3:.2f}\" y=\"{4:.2f}\" text-anchor=\"end\">{5}</text>\n",
        x.begin_px, x.end_px, at, x.end_px - 4.0, at - 4.0, html_escaped(guide.name));
  }
  return svg;
}

size_t style_of(const PlotSeries& series, size_t place) {
  return series.style >= 0 ? static_cast<size_t>(series.style) : place;
}

std::string legend_svg(const PlotDesc& desc, double x_px) {
  std::string svg;
  double y_px = kTop + 8.0;
  for (size_t i = 0; i < desc.series.size(); ++i) {
    const PlotSeries& series = desc.series[i];
    if (!series.has_legend) continue;
    const size_t style = style_of(series, i);
    if (series.mark != PlotMark::Dots) {
      svg += fmt::format("<line class=\"line\" x1=\"{:.2f}\" x2=\"{:.2f}\" y1=\"{:.2f}\" y2=\"{:.2f}\"{}/>\n",
                         x_px, x_px + 20.0, y_px, y_px, stroke_of(style));
    }
    if (series.mark != PlotMark::Line) svg += mark_svg(style, x_px + 10.0, y_px, "");
    svg += fmt::format("<text x=\"{:.2f}\" y=\"{:.2f}\">{}</text>\n", x_px + 27.0, y_px + 4.0,
                       html_escaped(series.name));
    y_px += kLegendStep;
  }
  return svg;
}

std::vector<double> log_ticks(double minimum, double maximum) {
  const double first = std::log10(minimum);
  const double last = std::log10(maximum);
  const double decades = last - first;
  const int stride = decades > kManyDecades ? static_cast<int>(std::ceil(decades / kManyDecades)) : 1;
  constexpr double kTolerance = 1e-9;
  std::vector<double> ticks;
  for (int decade = static_cast<int>(std::floor(first)); decade <= static_cast<int>(std::ceil(last));
       ++decade) {
    if (decade % stride != 0) continue;
    for (const double factor : {1.0, 2.0, 5.0}) {
      if (factor > 1.0 && decades > kFewDecades) continue;
      const double measure = decade + std::log10(factor);
      if (measure >= first - kTolerance && measure <= last + kTolerance)
        ticks.push_back(factor * std::pow(10.0, decade));
    }
  }
  return ticks;
}

std::vector<double> linear_ticks(double minimum, double maximum) {
  constexpr double kWanted = 6.0;
  const double rough = (maximum - minimum) / kWanted;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * power;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * power >= rough) step = factor * power;
  }
  std::vector<double> ticks;
  const auto first = static_cast<int64_t>(std::ceil(minimum / step - 1e-9));
  const auto last = static_cast<int64_t>(std::floor(maximum / step + 1e-9));
  for (int64_t i = first; i <= last; ++i) ticks.push_back(static_cast<double>(i) * step);
  return ticks;
}

}  // namespace

const char* plot_style_sheet() {
  return kStyle;
}

const char* plot_color(size_t style) {
  return kColors[style % kColors.size()];
}

std::vector<double> plot_ticks(PlotScale scale, double minimum, double maximum) {
  if (!(minimum < maximum) || !std::isfinite(minimum) || !std::isfinite(maximum)) return {};
  if (scale == PlotScale::Linear) return linear_ticks(minimum, maximum);
  return minimum > 0.0 ? log_ticks(minimum, maximum) : std::vector<double>{};
}

std::string make_svg_plot(const PlotDesc& desc) {
  std::vector<double> xs;
  std::vector<double> ys;
  for (const PlotSeries& series : desc.series) {
    for (const PlotPoint& point : series.points) {
      xs.push_back(point.x);
      ys.push_back(point.y);
    }
  }
  const Axis x = make_axis(desc.x, xs, kLeft, desc.width - kRight);
  const Axis y = make_axis(desc.y, ys, desc.height - kBottom, kTop);
  std::string svg = fmt::format(
      "<svg class=\"plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:g} {1:g}\" width=\"{0:g}\" "
      "height=\"{1:g}\" role=\"img\" aria-label=\"{2}\">\n{3}\n",
      desc.width, desc.height, html_escaped(desc.title), kStyle);
  svg += axes_svg(desc, x, y) + guides_svg(desc, x, y);
  const bool has_points = std::any_of(desc.series.begin(), desc.series.end(), [&](const PlotSeries& series) {
    return std::any_of(series.points.begin(), series.points.end(),
                       [&](const PlotPoint& point) { return x.can_show(point.x) && y.can_show(point.y); });
  });
  if (!has_points) {
    svg += fmt::format("<text x=\"{:.2f}\" y=\"{:.2f}\" text-anchor=\"middle\">nothing was measured</text>\n",
                       0.5 * (x.begin_px + x.end_px), 0.5 * (y.begin_px + y.end_px));
  }
  for (size_t i = 0; i < desc.series.size(); ++i)
    svg += series_svg(desc.series[i], style_of(desc.series[i], i), x, y);
  return svg + legend_svg(desc, x.end_px + 16.0) + "</svg>\n";
}

std::string html_escaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

}  // namespace strandcast
