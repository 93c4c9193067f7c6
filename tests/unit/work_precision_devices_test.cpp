// Fronts of several executors beside each other, and what one saves, from made-up runs.
#include "server/report/work_precision_devices.h"

#include "server/report/work_precision_page.h"

namespace strandcast::work_precision_devices_test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

struct MadeUpRun {
  const char* row;
  const char* ran_on;
  double rate_hz;
  double us;
  double error;
};

WorkReport report_of(const std::vector<SimDevice>& devices, const std::vector<MadeUpRun>& runs) {
  WorkReport report;
  report.motion_name = "nodding";
  report.grid.hairs = {MotionHair::Straight};
  for (const SimDevice device : devices)
    report.executors.push_back({device, std::string("a machine's ") + to_string(device), true});
  for (const MadeUpRun& run : runs) {
    WorkRecord record;
    record.test = motion_test(MotionHair::Straight);
    record.setting = {*find_solver(run.row), Material::Hair, 16, run.rate_hz};
    record.ran_on = run.ran_on;
    record.us = run.us;
    record.result.error = run.error;
    report.records.push_back(record);
  }
  return report;
}

// Errors are those of the model on either; on lanes direct_rod is so much faster that it beats dftl, by
// OpenGL it is not. tractrix_emulation stands for a row that takes the processor on either.
WorkReport both() {
  return report_of({SimDevice::Gl, SimDevice::Lanes}, {{"dftl", "gl", 60.0, 2.0, 0.5},
                                                       {"dftl", "lanes", 60.0, 1.0, 0.5},
                                                       {"dftl", "gl", 120.0, 4.0, 0.4},
                                                       {"dftl", "lanes", 120.0, 1.0, 0.4},
                                                       {"direct_rod", "gl", 60.0, 10.0, 0.005},
                                                       {"direct_rod", "lanes", 60.0, 0.5, 0.005},
                                                       {"tractrix_emulation", "double", 60.0, 0.1, 0.9}});
}

TEST(WorkPrecisionDevices, EveryExecutorHasAFrontOfItsOwn) {
  const WorkReport report = both();
  EXPECT_THAT(front_devices(report), ElementsAre("gl", "lanes"));
  EXPECT_THAT(front_methods(motion_points(report, MotionHair::Straight, "gl")),
              ElementsAre("tractrix_emulation", "dftl", "direct_rod"));
  EXPECT_THAT(front_methods(motion_points(report, MotionHair::Straight, "lanes")),
              ElementsAre("tractrix_emulation", "direct_rod"));
}

TEST(WorkPrecisionDevices, OneExecutorOrNoneHasOneFrontOfAllRuns) {
  for (const std::vector<SimDevice>& devices : {std::vector<SimDevice>{}, {SimDevice::Lanes}}) {
    const WorkReport report = report_of(devices, {{"dftl", "lanes", 60.0, 1.0, 0.5}});
    EXPECT_THAT(front_devices(report), ElementsAre(""));
    EXPECT_EQ(motion_points(report, MotionHair::Straight, "").size(), 1u);
    EXPECT_EQ(devices_summary(report, MotionHair::Straight), "");
    EXPECT_THAT(work_precision_page(report), Not(HasSubstr("beside each other")));
  }
}

TEST(WorkPrecisionDevices, RatiosAreOfTheSameSettings) {
  const auto ratios = device_ratios(both(), MotionHair::Straight, "lanes", "gl");
  ASSERT_EQ(ratios.size(), 2u) << "a row without a kernel has nothing to compare";
  EXPECT_EQ(ratios[0].method, "dftl");
  EXPECT_EQ(ratios[0].settings, 2u);
  EXPECT_DOUBLE_EQ(ratios[0].least, 0.25);
  EXPECT_DOUBLE_EQ(ratios[0].median, 0.375);
  EXPECT_DOUBLE_EQ(ratios[0].most, 0.5);
  EXPECT_EQ(ratios[1].method, "direct_rod");
  EXPECT_DOUBLE_EQ(ratios[1].median, 0.05);
  // A run that one executor could not do is compared with nothing.
  const WorkReport holed = report_of({SimDevice::Gl, SimDevice::Lanes},
                                     {{"dftl", "gl", 60.0, NAN, 0.5}, {"dftl", "lanes", 60.0, 1.0, 0.5}});
  EXPECT_TRUE(device_ratios(holed, MotionHair::Straight, "lanes", "gl").empty());
}

TEST(WorkPrecisionDevices, ThePageShowsBothFrontsAndWhatLanesSave) {
  const WorkReport report = both();
  EXPECT_THAT(devices_summary(report, MotionHair::Straight),
              AllOf(HasSubstr("tractrix_emulation, dftl, direct_rod on gl"),
                    HasSubstr("tractrix_emulation, direct_rod on lanes"),
                    HasSubstr("lanes take 0.21 times what gl takes, in the median of 2 models")));
  const std::string plot = devices_plot(report, MotionHair::Straight);
  EXPECT_THAT(plot, AllOf(HasSubstr(">gl</text>"), HasSubstr(">lanes</text>")));
  const std::string on_lanes = motion_plot(report, MotionHair::Straight, "lanes");
  EXPECT_THAT(on_lanes, AllOf(HasSubstr("on lanes"), HasSubstr(">dftl</text>"),
                              HasSubstr(">best on gl</text>"), Not(HasSubstr(">best on lanes</text>"))));
  EXPECT_THAT(motion_plot(report, MotionHair::Straight, "gl"), HasSubstr(">best on lanes</text>"));
  const std::string page = work_precision_page(report);
  EXPECT_THAT(page, AllOf(HasSubstr("gl, lanes beside each other"), HasSubstr(plot),
                          HasSubstr("a machine&#39;s gl and on a machine&#39;s lanes"),
                          HasSubstr("nodding, on gl: does any other"),
                          HasSubstr("nodding, on lanes: does any other")));
  EXPECT_THAT(work_precision_summary(report), HasSubstr("0.21 times"));
}

}  // namespace
}  // namespace strandcast::work_precision_devices_test
