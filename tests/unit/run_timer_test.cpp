// The times of the work-precision report, by a clock that the models turn themselves.
#include "server/report/run_timer.h"

#include "server/report/work_precision_page.h"

namespace strandcast::run_timer_test {
namespace {

/// Takes so long for a substep, and twice as long for every second one.
class TimedModel : public Solver {
 public:
  TimedModel(int64_t& clock_ns, int64_t step_ns) : clock_ns_(clock_ns), step_ns_(step_ns) {}
  Status load(const Groom&, const glm::dquat&) override { return {}; }
  void substep(const StepInput&) override { clock_ns_ += step_ns_ * (1 + step_++ % 2); }
  void read(SolverState&) override {}
  void write(const SolverState&) override {}
  void rebase(const glm::dquat&) override {}
  uint32_t strand_count() const override { return 0; }
  uint64_t memory_bytes() const override { return 0; }

 private:
  int64_t& clock_ns_;
  int64_t step_ns_;
  int step_ = 0;
};

constexpr int64_t kStepNs = 6'000;

// What is written down for a row is what its substeps took: whatever the row, and each in its own cell.
TEST(RunTimer, EveryRowsTimeIsWhatItsSubstepsTook) {
  const auto motion = MotionSet::make({});
  int64_t clock_ns = 0;
  const Workbench workbench;
  WorkReport report;
  std::vector<SolverRow> rows = solver_table();
  for (SolverRow& row : rows) {
    row.check_step = {};
    row.make_reference = [&clock_ns](const SolverParameters&) {
      return std::make_unique<TimedModel>(clock_ns, kStepNs);
    };
    RunTimer timer(workbench, *motion, [&clock_ns] { return clock_ns; });
    WorkRecord record;
    record.test = motion_test(MotionHair::Straight);
    record.setting = {&row, Material::AsShipped, 8, 120.0, 2};
    record.result.error = 0.5;
    const auto time = timer.time(record.setting);
    ASSERT_TRUE(time) << time.error().to_string();
    const double us = 1e-3 * kStepNs / timer.strand_count(record.setting);
    EXPECT_NEAR(time->best_us, us, 1e-9) << row.name;
    EXPECT_NEAR(time->median_us, 2.0 * us, 1e-9) << row.name;
    add_time(record, *time);
    // A frame of 1/60 s has two steps of 120 Hz of two substeps each.
    EXPECT_NEAR(record.us, 4.0 * us, 1e-9) << row.name;
    EXPECT_NEAR(record.median_us, 8.0 * us, 1e-9) << row.name;
    report.records.push_back(record);
  }
  for (const WorkPoint& point : motion_points(report, MotionHair::Straight))
    EXPECT_EQ(point.us, report.records.front().us) << point.label;
  const std::string csv = work_precision_csv(report);
  const std::string cells = fmt::format(",{:g},{:g},", report.records[0].us, report.records[0].median_us);
  size_t lines = 0;
  for (size_t at = csv.find(cells); at != std::string::npos; at = csv.find(cells, at + 1)) ++lines;
  EXPECT_EQ(lines, rows.size()) << csv;
  // 10,000 strands of 12 microseconds each.
  EXPECT_THAT(work_precision_page(report), testing::HasSubstr(">120 ms</td>"));
}

}  // namespace
}  // namespace strandcast::run_timer_test
