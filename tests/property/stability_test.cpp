// The promises of the stability report on its reduced grid, for every row of the solver table. What a row is
// known to break stands in known_breaks() with the reason; anything else that breaks fails here, and so does
// an entry that nothing breaks any more.
#include "server/report/stability.h"

#include <numbers>
#include <set>
#include <tuple>

#include "server/report/stability_observer.h"
#include "tests/support/claims.h"
#include "tests/support/solver_fixture.h"
#include "tests/support/test_grid.h"

namespace strandcast::stability_test {
namespace {

using testing::HasSubstr;

/// An entry may stay while its row comes within this share of the limit: other devices round otherwise.
constexpr double kNearTheLimit = 0.5;

bool is_in(StabilityGrid grid, const KnownBreak& known) {
  const std::vector<StabilityTrial> trials = make_stability_trials(grid);
  return std::any_of(trials.begin(), trials.end(), [&](const StabilityTrial& trial) {
    return trial.group == known.group && trial.setting == known.setting && trial.measures(known.measure);
  });
}

/// Lanes walk every trial; OpenGL, which takes ten times as long on processors, the first of each group, or
/// of rows that few scenes have the very first, but all of them in the whole grid.
bool is_walked(SimDevice device, bool is_usual, const StabilityTrial& trial, std::set<std::string>& groups) {
  const bool is_first = groups.insert(trial.group).second && (is_usual || groups.size() == 1);
  return device == SimDevice::Lanes || is_first || test_grid() == TestGrid::Whole;
}

class Stability : public SolverTest,
                  public testing::WithParamInterface<std::tuple<std::string, SimDevice>> {};

TEST_P(Stability, PromisesAreKept) {
  const auto& [row_name, device] = GetParam();
  const SolverRow& row = **find_solver(row_name);
  StabilityRunner runner(&executors_.on(device));
  std::set<std::string> groups;
  std::vector<const KnownBreak*> seen;
  double violent_stretch = 0.0;
  for (const StabilityTrial& trial : make_stability_trials(StabilityGrid::Reduced)) {
    if (!is_for(row, trial) || !is_walked(device, is_walked_by_gl(row), trial, groups)) continue;
    SCOPED_TRACE(fmt::format("{}, {}", trial.group, trial.setting));
    const auto outcome = runner.run(row, trial);
    ASSERT_TRUE(outcome) << outcome.error().to_string();
    const auto& stretch = outcome->cells[static_cast<size_t>(StabilityMeasure::Stretch)];
    if (trial.group == "motion" && stretch) violent_stretch = std::max(violent_stretch, stretch->value);
    for (const auto& cell : outcome->cells) {
      if (!cell) continue;
      const auto measure = static_cast<StabilityMeasure>(&cell - outcome->cells.data());
      if (cell->known_break == nullptr) {
        EXPECT_TRUE(cell->is_kept()) << name_of(measure) << ": " << cell->value << " > "
                                     << cell->promise.limit;
        continue;
      }
      EXPECT_LE(cell->value, cell->known_break->ceiling()) << name_of(measure);
      if (cell->value > kNearTheLimit * cell->promise.limit) seen.push_back(cell->known_break);
    }
  }
  if (device != SimDevice::Lanes) return;
  for (const KnownBreak& known : known_breaks()) {
    if (row.name != known.row || !is_in(StabilityGrid::Reduced, known)) continue;
    EXPECT_THAT(seen, testing::Contains(&known)) << known.group << " " << known.setting << ", "
                                                 << name_of(known.measure) << " is kept: remove the entry";
  }
  const double claimed = row.name == "pbd"    ? claims::kPbdViolentStretch
                         : row.name == "xpbd" ? claims::kXpbdViolentStretch
                                              : 0.0;
  if (claimed == 0.0) return;
  EXPECT_LE(violent_stretch, claimed);
  EXPECT_GE(violent_stretch, 0.9 * claimed) << "the documents say more than is true";
}

std::vector<std::string> row_names() {
  std::vector<std::string> names;
  for (const SolverRow& row : solver_table()) names.push_back(row.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(EveryRow, Stability,
                         testing::Combine(testing::ValuesIn(row_names()), testing::ValuesIn(sim_devices())),
                         [](const auto& row) {
                           return std::get<0>(row.param) + "_" + to_string(std::get<1>(row.param));
                         });

TEST(KnownBreaks, NameRowsAndTrials) {
  for (const KnownBreak& known : known_breaks()) {
    EXPECT_TRUE(find_solver(known.row)) << known.row;
    EXPECT_TRUE(is_in(StabilityGrid::Full, known))
        << known.row << ", " << known.group << " " << known.setting;
    EXPECT_GT(known.measured, 0.0) << known.row << ", " << known.group << " " << known.setting;
    EXPECT_GT(std::string(known.reason).size(), 20u) << known.row;
  }
}

// ---- the measures, on models that do one thing wrong ----

/// Moves every vertex that is not a root as `move` says, in each step.
class FakeModel : public Solver {
 public:
  using Move = std::function<void(int step, const StepInput& input, SolverState& state)>;
  FakeModel(Groom groom, Move move) : groom_(std::move(groom)), move_(std::move(move)) {}
  Status load(const Groom& groom, const glm::dquat& world_from_head_rotation) override {
    groom_ = groom;
    step_ = 0;
    const uint32_t strand_count = groom.strand_count();
    state_.position_m.resize(groom.rest_position_m.size());
    state_.velocity_mps.assign(groom.rest_position_m.size(), glm::vec3(0.0f));
    for (uint32_t s = 0; s < strand_count; ++s)
      for (uint32_t i = 0; i < groom.vertex_count(s); ++i)
        state_.position_m[i * strand_count + s] =
            glm::vec3(world_from_head_rotation * glm::dvec3(groom.rest_position_m[groom.offset[s] + i]));
    return {};
  }
  void substep(const StepInput& input) override { move_(step_++, input, state_); }
  void read(SolverState& state) override { state = state_; }
  void write(const SolverState& state) override { state_ = state; }
  void rebase(const glm::dquat&) override {}
  uint32_t strand_count() const override { return groom_.strand_count(); }
  uint64_t memory_bytes() const override { return 0; }

 private:
  Groom groom_;
  Move move_;
  SolverState state_;
  int step_ = 0;
};

SolverRow row_of(const FakeModel::Move& move) {
  SolverRow row;
  row.name = "fake";
  row.make_reference = [move](const SolverParameters&) { return std::make_unique<FakeModel>(Groom(), move); };
  return row;
}

constexpr double kStepS = 1.0 / 60.0;

StabilityTrial trial_of(const std::string& group, StabilityMeasure measure) {
  for (StabilityTrial& trial : make_stability_trials(StabilityGrid::Reduced)) {
    if (trial.group == group && trial.measures(measure)) return trial;
  }
  ADD_FAILURE() << group;
  return {};
}

StabilityCell cell_of(const FakeModel::Move& move, const std::string& group, StabilityMeasure measure) {
  StabilityRunner runner(nullptr);
  const auto outcome = runner.run(row_of(move), trial_of(group, measure));
  EXPECT_TRUE(outcome) << outcome.error().to_string();
  return outcome->cells[static_cast<size_t>(measure)].value();
}

void stay(int, const StepInput&, SolverState&) {}

TEST(StabilityMeasures, AModelThatStaysKeepsThemAll) {
  for (const auto measure : {StabilityMeasure::Finite, StabilityMeasure::Stretch, StabilityMeasure::Style})
    EXPECT_TRUE(cell_of(stay, "rest", measure).is_kept()) << name_of(measure);
  EXPECT_TRUE(cell_of(stay, "motion", StabilityMeasure::Jitter).is_kept());
  EXPECT_TRUE(cell_of(stay, "motion", StabilityMeasure::Rest).is_kept());
  EXPECT_TRUE(cell_of(stay, "energy", StabilityMeasure::Energy).is_kept());
}

TEST(StabilityMeasures, ABrokenNumberIsCountedAndSpoilsTheOthers) {
  const auto burst = [](int step, const StepInput&, SolverState& state) {
    if (step == 30) state.velocity_mps.back().x = NAN;
    if (step == 33) state.velocity_mps.back().x = 0.0f;
  };
  EXPECT_EQ(cell_of(burst, "rest", StabilityMeasure::Finite).value, 3.0);
  EXPECT_FALSE(cell_of(burst, "rest", StabilityMeasure::Stretch).is_kept());
}

TEST(StabilityMeasures, StretchIsRelativeToTheSegment) {
  const auto pull = [](int step, const StepInput&, SolverState& state) {
    const size_t strand_count = 7;
    const size_t tip = state.position_m.size() - 1;
    const glm::vec3 edge = state.position_m[tip] - state.position_m[tip - strand_count];
    if (step == 10) state.position_m[tip] += 0.2f * edge;
  };
  EXPECT_NEAR(cell_of(pull, "rest", StabilityMeasure::Stretch).value, 0.2, 1e-5);
}

TEST(StabilityMeasures, AFreeFallGrowsNoEnergyAndAPushDoes) {
  const auto fall = [](double push) {
    return [push](int step, const StepInput& input, SolverState& state) {
      if (step >= 30) return;  // caught, before floats are too coarse
      for (size_t i = 0; i < state.position_m.size(); ++i) {
        state.velocity_mps[i] += glm::vec3(input.h_s * (1.0 + push) * input.gravity_mps2);
        state.position_m[i] += glm::vec3(input.h_s * glm::dvec3(state.velocity_mps[i]));
      }
    };
  };
  EXPECT_LE(cell_of(fall(0.0), "energy", StabilityMeasure::Energy).value, 1e-3);
  EXPECT_FALSE(cell_of(fall(0.02), "energy", StabilityMeasure::Energy).is_kept());
}

TEST(StabilityMeasures, RestIsWhenTheLastVertexStops) {
  const double moving_s = trial_of("motion", StabilityMeasure::Rest).moving_s;
  const auto creep_until = [moving_s](double end_s) {
    return [=](int step, const StepInput&, SolverState& state) {
      if (step * kStepS < moving_s + end_s) state.position_m.back().x += static_cast<float>(2e-4);
    };
  };
  EXPECT_NEAR(cell_of(creep_until(4.0), "motion", StabilityMeasure::Rest).value, 4.0, 2.0 * kStepS);
  EXPECT_TRUE(std::isinf(cell_of(creep_until(1e9), "motion", StabilityMeasure::Rest).value));
}

TEST(StabilityMeasures, JitterIsWhatAlternatesAndNotWhatSwings) {
  std::vector<glm::dvec3> alternating, swinging;
  for (int i = 0; i < 128; ++i) {
    alternating.emplace_back(i % 2 == 0 ? 1e-4 : -1e-4, 0.0, 0.0);
    swinging.emplace_back(0.0, 0.1 * std::sin(2.0 * std::numbers::pi * 1.3 * i * kStepS), 0.0);  // 6.7 m/s^2
  }
  EXPECT_NEAR(upper_band_acceleration_mps2(alternating, kStepS), 4e-4 / (kStepS * kStepS), 1e-3);
  EXPECT_LE(upper_band_acceleration_mps2(swinging, kStepS), 1e-3);
}

TEST(StabilityMeasures, AStepThatARowRefusesIsNotRun) {
  SolverRow row = row_of(stay);
  row.check_step = [](const SolverParameters&, double substep_s) -> Status {
    if (substep_s < 0.05) return {};
    return make_error(ErrorCode::BadInput, "too long");
  };
  StabilityRunner runner(nullptr);
  int refused = 0;
  for (const StabilityTrial& trial : make_stability_trials(StabilityGrid::Reduced)) {
    if (trial.group != "step") continue;
    const auto outcome = runner.run(row, trial);
    ASSERT_TRUE(outcome);
    refused += outcome->refusal == "too long" ? 1 : 0;
  }
  EXPECT_EQ(refused, 3) << "1/15 s, 1/10 s and the varying ones";
}

// A spring that is allowed up to k = 100 and refused from there on, whatever it starts from.
TEST(StabilityMeasures, ExplicitTrialsStandOnEitherSideOfTheLimit) {
  SolverRow row = row_of(stay);
  row.parameters = {{"integrator", 2.0, 0.0, 2.0, "", ""}, {"stretch_stiffness", 3.0, 0.0, 1e9, "", ""}};
  row.check_step = [](const SolverParameters& parameters, double) -> Status {
    if (parameters.at("integrator") == 2.0 || parameters.at("stretch_stiffness") < 100.0) return {};
    return make_error(ErrorCode::BadInput, "k is {:.0f}, the limit 100", parameters.at("stretch_stiffness"));
  };
  StabilityRunner runner(nullptr);
  std::vector<std::string> seen;
  for (const StabilityTrial& trial : make_stability_trials(StabilityGrid::Reduced)) {
    if (trial.group != "explicit") continue;
    EXPECT_FALSE(is_for(row_of(stay), trial));
    ASSERT_TRUE(is_for(row, trial));
    const auto outcome = runner.run(row, trial);
    ASSERT_TRUE(outcome);
    seen.push_back(outcome->refusal.empty() ? outcome->note : outcome->refusal);
  }
  EXPECT_THAT(seen, testing::ElementsAre(HasSubstr("3 -> 95"), "k is 105, the limit 100",
                                         HasSubstr("3 -> 95"), "k is 105, the limit 100"));
}

TEST(ScaleStiffness, RaisesStiffnessLowersComplianceAndSaysWhereItEnds) {
  SolverRow row;
  row.parameters = {{"bend_stiffness", 2.0, 0.0, 100.0, "", ""},
                    {"stretch_compliance_m_per_n", 1.0, 0.0, 10.0, "", ""},
                    {"young_modulus_pa", 3.0, 0.0, 1e9, "", ""},
                    {"drag", 5.0, 0.0, 10.0, "", ""}};
  const ScaledStiffness scaled = scale_stiffness(row, *complete_parameters(row, {}), 1000.0);
  const SolverParameters expected = {{"bend_stiffness", 100.0},
                                     {"stretch_compliance_m_per_n", 1e-3},
                                     {"young_modulus_pa", 3000.0},
                                     {"drag", 5.0}};
  EXPECT_EQ(scaled.parameters, expected);
  EXPECT_THAT(scaled.note, HasSubstr("bend_stiffness 2 -> 100 (as far as it goes)"));
  EXPECT_THAT(scaled.note, testing::Not(HasSubstr("drag")));
}

// ---- what is written ----

TEST(StabilityTables, ABrokenPromiseIsRedWithNumberLimitAndReason) {
  const KnownBreak known{"fake", "rest", "hanging", StabilityMeasure::Style, 0.25, "it was told to"};
  StabilityOutcome outcome{"fake", "rest", "hanging", "a note", "", {}};
  outcome.cells[static_cast<size_t>(StabilityMeasure::Finite)] = StabilityCell{0.0, {0.0}, nullptr};
  outcome.cells[static_cast<size_t>(StabilityMeasure::Style)] = StabilityCell{0.25, {0.125}, &known};
  const StabilityOutcome refused{"fake", "step", "1/10 s", "", "h must stay below 1", {}};
  const std::vector<StabilityOutcome> outcomes = {outcome, refused};
  const std::string page = stability_page(outcomes, {"a device", StabilityGrid::Quick});
  EXPECT_THAT(page, HasSubstr("bad\">2.5e-01 &gt; 1.2e-01"));
  EXPECT_THAT(page, HasSubstr("Red, rest hanging, style: it was told to."));
  EXPECT_THAT(page, HasSubstr("<td></td>")) << "what was not measured has no colour";
  EXPECT_THAT(page, HasSubstr("1 of 2, 1 refused"));
  EXPECT_THAT(page, HasSubstr("h must stay below 1"));
  EXPECT_THAT(page, HasSubstr("quick"));
  EXPECT_THAT(page, testing::Not(HasSubstr("0 of 0")));
  const std::string csv = stability_csv(outcomes);
  EXPECT_THAT(csv, HasSubstr("fake,rest,hanging,style,0.25,0.125,no,it was told to"));
  EXPECT_THAT(csv, HasSubstr("refused"));
  EXPECT_THAT(stability_text(outcomes), HasSubstr("2.5e-01!"));
}

}  // namespace
}  // namespace strandcast::stability_test
