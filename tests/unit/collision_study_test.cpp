// What keeps hair out of the head and of a body: finer fields are nearer to the truth than spheres, and
// answers that turn segments keep their lengths.
#include "server/report/collision_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/scene/scene_file.h"
#include "server/report/contact_depth.h"

namespace strandcast::collision_study_test {
namespace {

using testing::HasSubstr;

CollisionStudyDesc small_study() {
  CollisionStudyDesc desc;
  desc.scene =
      built_in_scene_with({"groom.procedural.strand_count=150", "groom.procedural.vertex_count=12"}).value();
  desc.resolutions = {16, 64};
  desc.shake_steps = 20;
  desc.rest_steps = 90;
  desc.body_steps = 110;
  desc.body_rest_steps = 60;
  return desc;
}

class CollisionStudies : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const auto executor = open_executor({"lanes", "auto", {}});
    ASSERT_TRUE(executor.ok());
    auto study = run_collision_study(small_study(), **executor, [](const std::string&) {});
    ASSERT_TRUE(study.ok()) << study.error().to_string();
    study_ = std::move(study).value();
  }
  static const HeadCollision& head(const std::string& name) {
    for (const HeadCollision& row : study_.head)
      if (row.name == name) return row;
    ADD_FAILURE() << "no row " << name;
    return study_.head.front();
  }
  static const BodyAnswer& body(const std::string& name) {
    for (const BodyAnswer& row : study_.body)
      if (row.name == name) return row;
    ADD_FAILURE() << "no row " << name;
    return study_.body.front();
  }
  static CollisionStudy study_;
};
CollisionStudy CollisionStudies::study_;

// A shake of 10 g drives free hair centimetres into a head that nothing guards; 64 cells keep it within the
// thickness of some hairs of the truth, at rest within the field's own error (a few percent of a cell).
TEST_F(CollisionStudies, FinerFieldsAreNearerToTheTruth) {
  ASSERT_EQ(study_.head.size(), 4u);
  EXPECT_GT(head("no head").shaken.vertex_most_m, 0.01);
  EXPECT_LT(head("spheres").shaken.vertex_usual_m, 0.5 * head("no head").shaken.vertex_usual_m);
  EXPECT_LT(head("field 64").shaken.vertex_usual_m, head("field 16").shaken.vertex_usual_m);
  EXPECT_LT(head("field 64").settled.vertex_most_m, head("spheres").settled.vertex_most_m);
  EXPECT_LT(head("field 64").settled.vertex_most_m, 0.1 * head("field 64").cell_m);
  EXPECT_LT(head("field 64").mesh_m, 0.1 * head("field 64").cell_m);
  EXPECT_EQ(head("no head").extra_cpu_ms, 0.0);
}

// By what each answer is: turning keeps lengths, projecting does not, pushing lets hair in.
TEST_F(CollisionStudies, AnswersToABodyDifferAsTheirLawsSay) {
  ASSERT_EQ(study_.body.size(), 1 + kBodyResponses.size());
  // The swing's peak: amplitude times angular frequency, of shoulder and elbow; capsules are head-relative.
  EXPECT_GT(study_.fastest_mps, 2.0);
  EXPECT_LT(study_.fastest_mps, 6.0);
  EXPECT_GT(body("no body").depth.vertex_most_m, 0.02);
  for (const char* turning : {"turn", "sphere"}) {
    EXPECT_LT(body(turning).stretch, 1e-4) << turning;
    EXPECT_LT(body(turning).depth.vertex_usual_m, 0.005) << turning;
    EXPECT_GT(body(turning).carried_share, 0.5) << turning;
  }
  EXPECT_GT(body("project").stretch, 0.01);
  // What comes out of one capsule may end just inside of the next.
  EXPECT_LT(body("project").depth.vertex_most_m, 0.001);
  EXPECT_GT(body("force").depth.vertex_usual_m, body("turn").depth.vertex_usual_m);
  EXPECT_FALSE(study_.moments.rgba.empty());
}

TEST_F(CollisionStudies, PageAndTablesHaveEveryRow) {
  const std::string page = collision_page(study_);
  for (const HeadCollision& row : study_.head) EXPECT_THAT(page, HasSubstr(row.name));
  for (const BodyAnswer& row : study_.body) {
    EXPECT_THAT(page, HasSubstr(row.name));
    EXPECT_THAT(body_answer_csv(study_), HasSubstr("\n" + row.name + ","));
  }
  EXPECT_THAT(page, HasSubstr("data:image/jpeg;base64,"));
  EXPECT_THAT(head_collision_csv(study_), HasSubstr("\nfield 64,64,"));
}

TEST(CollisionStudy, SolversWithoutAKernelAreRefusedByName) {
  const auto executor = open_executor({"lanes", "auto", {}});
  ASSERT_TRUE(executor.ok());
  CollisionStudyDesc desc = small_study();
  desc.scene.solver.name = "super_helix";
  const auto study = run_collision_study(desc, **executor, [](const std::string&) {});
  ASSERT_FALSE(study.ok());
  EXPECT_EQ(study.error().code, ErrorCode::BadInput);
  EXPECT_THAT(study.error().message, HasSubstr("super_helix"));
}

TEST(ContactDepth, CountsWhatIsInsideAndNothingElse) {
  DepthRecord record;
  for (int i = 0; i < 999; ++i) record.add_vertex(-0.01);
  record.add_vertex(0.02);
  record.add_middle(-0.5);
  record.add_middle(0.003);
  const CollisionDepth depth = record.depth();
  EXPECT_DOUBLE_EQ(depth.vertex_most_m, 0.02);
  EXPECT_LT(depth.vertex_usual_m, 0.02);
  EXPECT_DOUBLE_EQ(depth.middle_most_m, 0.003);
  SolverState before, after;
  before.position_m = {{0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}};
  after.position_m = {{0.003f, 0.0f, 0.0f}, {0.0f, 0.004f, 0.0f}};
  EXPECT_NEAR(speed_rms_mps(before, after, 0.5), 1e-3 * std::sqrt(12.5) / 0.5, 1e-9);
}

}  // namespace
}  // namespace strandcast::collision_study_test
