// Line and scatter plots as SVG text: linear or logarithmic axes, grid, legend, a tooltip per point. No
// dependency, no randomness: the same input gives the same bytes. Stands alone as a file and inside a page,
// in light and dark. Any thread.
#pragma once

#include <limits>
#include <string>
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
  /// Series with the same index look alike from plot to plot; -1: their place in the plot.
  int style = -1;
  bool is_faint = false;  // background to the others
  bool has_legend = true;
};

/// A horizontal line with a name: a bound, a target.
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

/// Points that an axis cannot show (not finite, not positive on a logarithmic axis) are left out; a point
/// outside a given range is drawn on the border. A plot without any point says so.
std::string make_svg_plot(const PlotDesc& desc);

/// What every plot of a page shares: its <style>, and the colour of a series' style.
const char* plot_style_sheet();
const char* plot_color(size_t style);

/// Where an axis has its labels, ascending, within [minimum, maximum].
std::vector<double> plot_ticks(PlotScale scale, double minimum, double maximum);

}  // namespace strandcast
