// What reports are written with: CSV, plots, pages.
#include <cmath>
#include <limits>

#include "common/log/progress.h"
#include "common/plot/svg_plot.h"
#include "server/report/html_page.h"
#include "server/report/report_files.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::report_files_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

size_t count_of(const std::string& text, const std::string& part) {
  size_t count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) ++count;
  return count;
}

TEST(CsvFile, QuotesOnlyWhatNeedsIt) {
  CsvFile csv({"name", "note"});
  csv.add_row({"plain", "a, b"});
  csv.add_row({"say \"x\"", "two\nlines"});
  EXPECT_EQ(csv.text(), "name,note\nplain,\"a, b\"\n\"say \"\"x\"\"\",\"two\nlines\"\n");
}

TEST(CsvFile, NumbersNameWhatIsMissingOrUnbounded) {
  EXPECT_EQ(csv_number(0.000123456789), "0.000123457");
  EXPECT_EQ(csv_number(kNan), "");
  EXPECT_EQ(csv_number(INFINITY), "inf");
}

TEST(SvgPlot, LogarithmicAxesAreLabelledAtPowersOfTen) {
  EXPECT_THAT(plot_ticks(PlotScale::Logarithmic, 0.5, 2e3), ElementsAre(1.0, 10.0, 100.0, 1000.0));
  EXPECT_THAT(plot_ticks(PlotScale::Logarithmic, 1.0, 10.0), ElementsAre(1.0, 2.0, 5.0, 10.0));
  EXPECT_THAT(plot_ticks(PlotScale::Linear, 0.0, 10.0), ElementsAre(0.0, 2.0, 4.0, 6.0, 8.0, 10.0));
  EXPECT_TRUE(plot_ticks(PlotScale::Logarithmic, -1.0, 10.0).empty());
  EXPECT_LE(plot_ticks(PlotScale::Logarithmic, 1e-300, 1e300).size(), 12u);
}

PlotDesc small_plot() {
  PlotDesc desc;
  desc.title = "error < time & \"more\"";
  desc.x = {.title = "time"};
  desc.y = {.title = "error"};
  desc.series.push_back({"one", {{1.0, 1.0}, {10.0, 0.1}, {100.0, 0.01, "best"}}});
  return desc;
}

/// The numbers after `name="` of every element of that kind.
std::vector<double> attribute_values(const std::string& svg, const std::string& element,
                                     const std::string& name) {
  std::vector<double> values;
  for (size_t at = svg.find("<" + element); at != std::string::npos; at = svg.find("<" + element, at + 1)) {
    const size_t begin = svg.find(" " + name + "=\"", at);
    values.push_back(std::stod(svg.substr(begin + name.size() + 3)));
  }
  return values;
}

TEST(SvgPlot, EqualRatiosAreEqualDistances) {
  const std::string svg = make_svg_plot(small_plot());
  // Three points and the mark of the legend.
  const std::vector<double> x = attribute_values(svg, "circle", "cx");
  const std::vector<double> y = attribute_values(svg, "circle", "cy");
  ASSERT_EQ(x.size(), 4u);
  EXPECT_NEAR(x[1] - x[0], x[2] - x[1], 0.02);
  EXPECT_NEAR(y[1] - y[0], y[2] - y[1], 0.02);
  EXPECT_GT(x[1], x[0]);
  EXPECT_GT(y[1], y[0]) << "less is lower";
  EXPECT_THAT(svg, HasSubstr("<title>best</title>"));
}

TEST(SvgPlot, TextCannotBreakOut) {
  const std::string svg = make_svg_plot(small_plot());
  EXPECT_THAT(svg, HasSubstr("error &lt; time &amp; &quot;more&quot;"));
  EXPECT_THAT(svg, Not(HasSubstr("error < time")));
}

TEST(SvgPlot, WhatAnAxisCannotShowIsLeftOut) {
  PlotDesc desc = small_plot();
  desc.series[0].points = {{0.0, 1.0}, {-1.0, 1.0}, {1.0, kNan}, {INFINITY, 1.0}, {2.0, 3.0}};
  EXPECT_EQ(count_of(make_svg_plot(desc), "<circle"), 2u) << "one point and the legend";
  desc.series[0].points.pop_back();
  EXPECT_THAT(make_svg_plot(desc), HasSubstr("nothing was measured"));
  EXPECT_THAT(make_svg_plot(desc), Not(HasSubstr("nan")));
}

TEST(SvgPlot, SameInputSameBytes) {
  EXPECT_EQ(make_svg_plot(small_plot()), make_svg_plot(small_plot()));
}

TEST(HtmlPage, IsSelfContainedAndEscapes) {
  HtmlPage page("a < b");
  page.heading("x & y");
  page.paragraph("<script>alert(1)</script>");
  page.table({"caption", {"name", "value"}, {{"n", "1.5"}, {"<b>", {"2", HtmlMark::Bad}}}});
  page.figure(make_svg_plot(small_plot()), "a plot");
  const std::string text = page.text();
  EXPECT_THAT(text, HasSubstr("<title>a &lt; b</title>"));
  EXPECT_THAT(text, Not(HasSubstr("<script")));
  EXPECT_THAT(text, Not(HasSubstr("<b>")));
  EXPECT_THAT(text, HasSubstr("<td class=\"number\">1.5</td>"));
  EXPECT_THAT(text, HasSubstr("<td class=\"number bad\">2</td>"));
  // The only address is the name of the SVG namespace.
  EXPECT_EQ(count_of(text, "://"), 1u);
  for (const char* loader : {"src=", "href=", "@import", "url("}) EXPECT_THAT(text, Not(HasSubstr(loader)));
  EXPECT_EQ(count_of(text, "<tr>"), count_of(text, "</tr>"));
}

TEST(HtmlPage, SentencesInTablesWrapAndNumbersDoNot) {
  const std::string text = HtmlPage("t").text();
  size_t found = 0;
  for (size_t at = text.find("nowrap"); at != std::string::npos; at = text.find("nowrap", at + 1)) {
    const size_t rule = text.rfind('}', at) + 1;
    EXPECT_THAT(text.substr(rule, at - rule), HasSubstr("td.number {"))
        << "a column of sentences pushes others off";
    ++found;
  }
  EXPECT_EQ(found, 1u);
}

TEST(Progress, ExpectsTheRestAtThePaceSoFar) {
  Progress progress({"test", true});
  progress.expect(4, 4.0);
  EXPECT_TRUE(std::isnan(progress.seconds_left()));
  progress.begin_run("first");
  progress.end_run(2.0);
  const double half_s = progress.seconds_left();
  EXPECT_GE(half_s, 0.0);
  progress.end_run(2.0);
  EXPECT_EQ(progress.seconds_left(), 0.0);
}

TEST(ReportFolder, IsMadeOrRefusedInOneSentence) {
  const TemporaryFolder folder;
  const auto nested = folder.path() / "a" / "b";
  ASSERT_TRUE(make_report_folder(nested));
  ASSERT_TRUE(save_text(nested / "file", "text"));
  const Status status = make_report_folder(nested / "file");
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::BadInput);
  EXPECT_THAT(status.error().to_string(), HasSubstr((nested / "file").string()));
}

TEST(ReportFolder, WhereNoFileMayBeWrittenIsSaidBeforeTheWork) {
  const std::filesystem::path folder = "/proc/self";  // nobody writes there
  const Status status = make_report_folder(folder);
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().to_string(), HasSubstr(folder.string()));

  const TemporaryFolder fine;
  ASSERT_TRUE(make_report_folder(fine.path()));
  EXPECT_TRUE(std::filesystem::is_empty(fine.path()));
}

}  // namespace
}  // namespace strandcast::report_files_test
