#include "server/report/rendering.h"

#include <set>

#include "common/base/base64.h"
#include "common/scene/shadow_methods.h"
#include "common/scene/strand_methods.h"
#include "server/report/html_page.h"
#include "tests/support/gl_fixture.h"

namespace strandcast::rendering_report_test {
namespace {

using testing::HasSubstr;

class RenderingReports : public GlTest {};

TEST_F(RenderingReports, MeasureEveryRowAgainstTheTruthOfItsGroup) {
  RenderingReportDesc desc;
  ProceduralGroomDesc groom;
  groom.strand_count = 200;
  groom.vertex_count = 8;
  desc.scene.groom = groom;
  desc.scene.look.segments = 1;
  desc.size = {96, 64};
  desc.rounds = 1;
  const auto report = run_rendering(desc);
  ASSERT_TRUE(report) << report.error().to_string();
  ASSERT_EQ(report->rows.size(), rendering_rows().size());
  std::set<std::string> names;
  for (const RenderingOutcome& row : report->rows) {
    EXPECT_TRUE(names.insert(row.name).second) << row.name;
    EXPECT_EQ(row.trouble, "") << row.name;
    for (const RenderingMeasure& measure : {row.near, row.far}) {
      EXPECT_GT(measure.cpu_ms, 0.0) << row.name;
      EXPECT_GT(measure.error.psnr_db, 10.0) << row.name;
      EXPECT_GT(measure.error.masked_share, 0.0) << row.name;
    }
    EXPECT_GT(row.memory_mb, 0.0) << row.name;
    // A row that is its group's truth differs from it by nothing.
    if (row.name == "gl shadow deep_shadow") {
      EXPECT_EQ(row.near.error.psnr_db, 99.0);
    }
  }
  // Every row of every table is there.
  const auto expect_all = [&](const auto& table, const std::string& kind, size_t first) {
    for (const MethodRow& row : table.rows().subspan(first))
      EXPECT_TRUE(names.contains("gl " + kind + " " + std::string(row.name))) << kind << ' ' << row.name;
  };
  expect_all(shadow_methods(), "shadow", 0);
  expect_all(transparency_methods(), "transparency", 0);
  expect_all(antialiasing_methods(), "edges", 0);
  expect_all(shading_models(), "shading", 0);
  expect_all(shading_places(), "evaluation", 0);
  expect_all(scattering_models(), "scattering", 0);
  expect_all(detail_methods(), "detail", 0);
  expect_all(curve_methods(), "curve", 1);
  expect_all(joint_methods(), "joints", 1);
  expect_all(culling_methods(), "culling", 1);
  const std::string csv = rendering_csv(*report);
  const std::string page = rendering_page(desc, *report);
  const std::string text = rendering_text(*report);
  for (const std::string& name : names) {
    EXPECT_THAT(csv, HasSubstr(name));
    EXPECT_THAT(page, HasSubstr(name));
    EXPECT_THAT(text, HasSubstr(name));
  }
  EXPECT_THAT(page, HasSubstr("data:image/jpeg;base64,/9j/"));
}

RenderingOutcome outcome_of(const std::string& name, double near_ms, double far_ms, double memory_mb) {
  RenderingOutcome row;
  row.name = name;
  row.is_gl = name != "main";
  row.near.cpu_ms = row.near.device_ms = near_ms;
  row.far.cpu_ms = row.far.device_ms = far_ms;
  row.near.drawn_strands = row.far.drawn_strands = 50'000.0;
  row.memory_mb = memory_mb;
  return row;
}

TEST(RenderingReportRows, LoseWhenSlowerNearAndFarAndLarger) {
  RenderingReport report;
  report.rows = {outcome_of("main", 10.0, 4.0, 20.0), outcome_of("slower near", 11.0, 4.0, 30.0),
                 outcome_of("smaller", 12.0, 5.0, 19.0), outcome_of("loses", 10.5, 4.5, 20.5)};
  EXPECT_THAT(losing_rows(report), testing::ElementsAre("loses"));
  report.rows.back().trouble = "not here";
  EXPECT_THAT(losing_rows(report), testing::IsEmpty());
}

TEST(RenderingReportRows, HaveTimesPerStrandWhereThereIsAGpu) {
  RenderingReport report;
  report.rows = {outcome_of("main", 10.0, 4.0, 20.0), outcome_of("drawn", 0.7, 0.25, 30.0)};
  EXPECT_THAT(rendering_text(report), testing::Not(HasSubstr("per 100,000")));
  report.has_gpu = true;
  // 50,000 strands in 0.7 ms are 1.4 ms per 100,000.
  EXPECT_THAT(rendering_text(report), HasSubstr("1.40"));
  EXPECT_THAT(rendering_page({}, report), HasSubstr("1.40"));
}

TEST(HtmlPages, CodePicturesInBase64) {
  const auto coded = [](std::string_view text) { return base64_of(std::as_bytes(std::span(text))); };
  // RFC 4648, section 10.
  EXPECT_EQ(coded(""), "");
  EXPECT_EQ(coded("f"), "Zg==");
  EXPECT_EQ(coded("fo"), "Zm8=");
  EXPECT_EQ(coded("foo"), "Zm9v");
  EXPECT_EQ(coded("foobar"), "Zm9vYmFy");
}

}  // namespace
}  // namespace strandcast::rendering_report_test
