// Grouped bar charts as SVG text, with the look of svg_plot.h: a group per thing, a bar per series, the value
// above each bar. Any thread.
#pragma once

#include <string>
#include <vector>

namespace strandcast {

struct BarSeries {
  std::string name;
  std::vector<double> value;  // one per group; NaN = no bar
  size_t style = 0;           // colour, as in PlotSeries
};

struct BarDesc {
  std::string title;
  std::string y_title;
  std::vector<std::string> groups;  // named below, slanted
  std::vector<BarSeries> series;
  double width = 860.0;   // px
  double height = 480.0;  // px
};

/// Bars stand on 0 with a linear scale. A chart without any bar says so.
std::string make_svg_bars(const BarDesc& desc);

}  // namespace strandcast
