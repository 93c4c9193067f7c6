// Line and scatter plots as SVG text: linear or logarithmic axes, grid, legend, a tooltip per point. No
// dependency, no randomness: the same input gives the same bytes. Stands alone as a file and inside a page,
// in light and dark. Any thread.
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace strandcast {

enum class PlotScale { Linear, Logarithmic };
enum class PlotMark { Dots, Line, LineAndDots };

struct PlotAxis {
  std::string title;
  PlotScale scale = PlotScale::Logarithmic;
  // NaN: from the data.
  double minimum = std::numeric_limits<double>::quiet_NaN();
  double maximum = std::numeric_limits<double>::quiet_NaN();
};

struct PlotPoint {
  double x = 0.0;
  double y = 0.0;
  std::string note = {};  // shown when the mouse rests on the point
};

struct PlotSeries {
  std::string name;
  std::vector<PlotPoint> points;  // lines join them in this order
  PlotMark mark = PlotMark::LineAndDots;
  /// Index of the series' appearance, the same in all plots; -1 uses its position in this plot.
  int style = -1;
  bool is_faint = false;  // background to the others
  bool has_legend = true;
};

/// A labelled horizontal line, for example a bound or a target.
struct PlotGuide {
  std::string name;
  double y = 0.0;
};

struct PlotDesc {
  std::string title;
  PlotAxis x;
  PlotAxis y;
  std::vector<PlotSeries> series;
  std::vector<PlotGuide> guides;
  double width = 860.0;   // px
  double height = 480.0;  // px
};

/// Draws a plot as SVG text. Points that an axis cannot show (not finite, or not positive on a logarithmic
/// axis) are omitted. Points outside a given range are drawn on the border. A plot without points shows a
/// note.
std::string make_svg_plot(const PlotDesc& desc);

/// Style sheet shared by all plots of a page, and the colour of a series' style.
const char* plot_style_sheet();
const char* plot_color(size_t style);

/// Returns the positions of axis labels, ascending, within [minimum, maximum].
std::vector<double> plot_ticks(PlotScale scale, double minimum, double maximum);

/// Replaces the five characters that have a meaning in HTML, SVG and XML with entities.
std::string html_escaped(std::string_view text);

}  // namespace strandcast
