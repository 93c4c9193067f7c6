// dftl_parallel comes in two forms, one invocation per vertex and one per strand. They are one model: each
// test here runs the form that this device would not choose by itself as well.
#include "tests/support/solver_fixture.h"

namespace strandcast::odd_even_test {
namespace {

constexpr double kSubstepS = 1.0 / 60.0;

/// One form on one executor: shared memory and its barriers are OpenGL's.
struct FormOn {
  SimDevice device;
  KernelForm form;
  std::string name() const {
    return std::string(to_string(device)) + (form == KernelForm::PerVertex ? ", per vertex" : ", per strand");
  }
};
constexpr FormOn kPerVertex = {SimDevice::Gl, KernelForm::PerVertex};
std::vector<FormOn> all_forms() {
  std::vector<FormOn> forms = {kPerVertex};
  for (const SimDevice device : sim_devices()) forms.push_back({device, KernelForm::PerStrand});
  return forms;
}

class OddEvenForms : public SolverTest {
 protected:
  std::unique_ptr<Solver> make_form(const FormOn& on, const Groom& groom,
                                    const SolverParameters& given = {}) {
    const SolverRow& row = **find_solver("dftl_parallel");
    auto solver = row.make(complete_parameters(row, given).value(),
                           {&executors_.on(on.device), all_features(), on.form});
    EXPECT_TRUE(solver) << solver.error().to_string();
    EXPECT_TRUE((*solver)->load(groom, {1.0, 0.0, 0.0, 0.0}));
    return std::move(solver).value();
  }
};

TEST_F(OddEvenForms, AllMoveAlike) {
  // Sums of lengths are rounded in another order. Where a strand is held at both ends and taut, a rounding e
  // of its reach moves it sideways by sqrt(2 e L), and from the next step on it folds elsewhere.
  constexpr double kTautRoundingM = 1.2e-4;  // e = 3e-8 m, L = 0.25 m
  for (const Pinning pinning : {Pinning::Root, Pinning::RootPair, Pinning::BothEnds}) {
    for (const double exact_length : {0.0, 1.0}) {
      TestGroomDesc desc;
      desc.pinning = pinning;
      const Groom groom = make_test_groom(desc);
      SCOPED_TRACE(fmt::format("pinning {}, exact {}", static_cast<int>(pinning), exact_length));
      auto per_vertex = make_form(kPerVertex, groom, {{"exact_length", exact_length}});
      const bool is_held = pinning == Pinning::BothEnds;
      const int steps = is_held ? 1 : 20;
      for (int step = 1; step <= steps; ++step) per_vertex->substep(moving_input(step, kSubstepS));
      for (const FormOn& form : all_forms()) {
        auto other = make_form(form, groom, {{"exact_length", exact_length}});
        for (int step = 1; step <= steps; ++step) other->substep(moving_input(step, kSubstepS));
        EXPECT_LE(largest_distance_m(read(*per_vertex).position_m, read(*other).position_m),
                  is_held ? kTautRoundingM : 1e-5)
            << form.name();
      }
    }
  }
}

TEST_F(OddEvenForms, HalfAsManyIterationsAsVerticesGiveTheSerialMotion) {
  const Groom groom = make_test_groom({});
  for (const FormOn& form : all_forms()) {
    auto solver = make_form(form, groom, {{"iterations", 8.0}, {"exact_length", 0.0}});
    auto serial = make({*find_solver("dftl"), {form.device}}, groom);
    for (int step = 1; step <= 60; ++step) {
      solver->substep(moving_input(step, kSubstepS));
      serial->substep(moving_input(step, kSubstepS));
    }
    EXPECT_EQ(read(*solver).position_m, read(*serial).position_m) << form.name();
    EXPECT_EQ(read(*solver).velocity_mps, read(*serial).velocity_mps) << form.name();
  }
}

TEST_F(OddEvenForms, AnyNumberOfVerticesAndStrands) {
  for (const uint32_t vertex_count : {3u, 4u, 5u, 17u, 64u}) {
    TestGroomDesc desc;
    desc.vertex_count = vertex_count;
    const Groom groom = make_test_groom(desc);
    for (const FormOn& form : all_forms()) {
      auto solver = make_form(form, groom);
      for (int step = 1; step <= 30; ++step) solver->substep(moving_input(step, kSubstepS));
      EXPECT_LE(length_excess_m(groom, read(*solver), 1e-5), 0.0) << vertex_count;
    }
  }
}

}  // namespace
}  // namespace strandcast::odd_even_test
