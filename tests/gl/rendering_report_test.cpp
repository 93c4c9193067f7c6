#include "server/report/rendering.h"

#include <set>

#include "server/report/html_page.h"
#include "tests/support/gl_fixture.h"

namespace strandcast {
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
}  // namespace strandcast
