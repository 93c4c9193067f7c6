// Grouped bar charts as SVG text, in the style of svg_plot.h: a group per subject, a bar per series, the
// value above each bar. Any thread.
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

/// Draws a bar chart with a linear scale from 0. A chart without bars shows a note.
std::string make_svg_bars(const BarDesc& desc);

}  // namespace strandcast
