// What artists set of hair (common/scene/hair_controls.h): that each changes the hair as it says, and that no
// change of quality takes it back.
#include "common/scene/hair_controls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/scene/scene_file.h"
#include "server/report/scene_run.h"
#include "server/scene/scene_content.h"
#include "server/sim/executor/lanes_executor.h"
#include "server/source/auto_quality.h"
#include "server/source/hair_factors.h"
#include "server/source/scene_change.h"
#include "server/source/scene_parameters.h"
#include "server/source/wet_hair.h"

namespace strandcast::hair_controls_test {
namespace {

using testing::HasSubstr;

constexpr const char* kControlPrefixes = "quality,hair.";

SceneDesc scene_with(std::vector<std::string> overrides) {
  overrides.insert(overrides.begin(), {"groom.procedural.strand_count=48", "groom.procedural.vertex_count=12",
                                       "wind.gust_intensity=0", "wind.mean_mps={ x: 0 y: 0 z: -4 }"});
  auto scene = built_in_scene_with(overrides);
  EXPECT_TRUE(scene) << scene.error().to_string();
  return *scene;
}

/// Mean way of the tips from where they were groomed, m, after so many seconds.
double tip_way_m(const SceneDesc& scene, const SceneContent& content, double seconds = 2.0) {
  const auto executor = std::move(make_lanes_executor()).value();
  auto run = SceneRun::make(scene, content, {}, *executor);
  EXPECT_TRUE(run) << run.error().to_string();
  Pose head;
  const int steps = static_cast<int>(seconds * scene.step_rate_hz);
  for (int i = 0; i < steps; ++i) EXPECT_TRUE((*run)->step(head));
  const auto snapshot = (*run)->publish();
  EXPECT_TRUE(snapshot);
  const uint32_t strands = content.groom.strand_count();
  double sum_m = 0.0;
  for (uint32_t s = 0; s < strands; ++s) {
    const uint32_t tip = content.groom.vertex_count(s) - 1;
    const size_t vertices = content.groom.rest_position_m.size();
    glm::vec3 now;
    for (int axis = 0; axis < 3; ++axis)
      now[axis] =
          (*snapshot)->quantum_m *
          static_cast<float>((*snapshot)->lattice[static_cast<size_t>(axis) * vertices + tip * strands + s]);
    sum_m += glm::distance(now, content.groom.rest_position_m[content.groom.offset[s] + tip]);
  }
  return sum_m / strands;
}

TEST(HairControls, AreListedInTheOrderOfTheirTableBehindTheQuality) {
  const ParameterList list =
      list_of(list_parameters(scene_with({"hair.length=0.5"})), {kControlPrefixes, 0, false});
  std::vector<std::string> paths;
  for (const ParameterInfo& info : list.parameters) paths.push_back(info.path);
  EXPECT_THAT(paths, testing::ElementsAre("quality", "hair.length", "hair.curl", "hair.stiffness",
                                          "hair.friction", "hair.wind"));
  EXPECT_EQ(list.parameters[0].unset_value, kAutoQuality);
  EXPECT_EQ(list.parameters[1].value, "0.5");
  for (size_t i = 1; i < list.parameters.size(); ++i) {
    const ParameterInfo& info = list.parameters[i];
    EXPECT_EQ(info.unset_value, "1") << info.path;
    EXPECT_TRUE(info.has_range && info.minimum < 1.0 && info.maximum > 1.0) << info.path;
    EXPECT_FALSE(info.unit.empty() || info.note.empty()) << info.path;
  }
}

TEST(HairControls, FrictionSaysWhereItRests) {
  const auto note_of = [](const SceneDesc& scene, const char* path) {
    return list_of(list_parameters(scene), {path, 0, false}).parameters.at(0).note;
  };
  EXPECT_THAT(note_of(scene_with({"quality=fast"}), "hair.friction"), HasSubstr("rests"));
  EXPECT_THAT(note_of(scene_with({"quality=full"}), "hair.friction"), HasSubstr("0 = it slides"));
  EXPECT_THAT(note_of(scene_with({"quality=auto"}), "quality"), HasSubstr("full runs"));
}

// What the machine chose, and why; a person's own choice needs no reason.
TEST(HairControls, QualitySaysWhyItRuns) {
  const auto note_of = [](const std::string& assignment, const std::string& reason) {
    return list_of(list_parameters(scene_with({assignment}), reason), {"quality", 0, false})
        .parameters.at(0)
        .note;
  };
  const std::string step = auto_quality(4.9, 60.0).reason;
  EXPECT_THAT(note_of("quality=auto", step),
              testing::EndsWith("; full runs, as a step of full takes 4.9 ms of the 16.7 ms there are"));
  EXPECT_THAT(note_of("quality=fast", "full does not keep up with real time"),
              testing::EndsWith("; fast runs, as full does not keep up with real time"));
  EXPECT_THAT(note_of("quality=fast", ""), Not(HasSubstr("runs")));
  EXPECT_LE(note_of("quality=auto", std::string(1000, 'x')).size(), kMaxParameterTextBytes);
}

TEST(HairControls, WhatIsNoValueIsRefusedInOneSentence) {
  const SceneDesc scene = scene_with({});
  for (const HairControl& control : kHairControls)
    for (const std::string value : {"nan", "inf", "-0.1", "99", "wide", ""}) {
      const std::string path = std::string("hair.") + control.name;
      const auto changed = with_overrides(scene, {path + "=" + value});
      ASSERT_FALSE(changed) << path << "=" << value;
      EXPECT_THAT(changed.error().to_string(), HasSubstr(control.name));
    }
  const auto unknown = change_scene(scene, "hair.colour=1");
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().to_string(), HasSubstr("hair"));
}

TEST(HairControls, AnotherQualityOrSolverLeavesThemAlone) {
  SceneDesc scene = scene_with({"quality=full", "hair.stiffness=3", "hair.wind=0.5", "hair.friction=2"});
  EXPECT_EQ(scene.quality, kFullQuality) << "they are no quality of one's own";
  const HairControls set = scene.hair;
  EXPECT_EQ(set.stiffness, 3.0);
  for (const char* change : {"quality=fast", "quality=full", "solver.name=xpbd", "quality=auto"}) {
    const auto changed = change_scene(scene, change);
    ASSERT_TRUE(changed) << changed.error().to_string();
    scene = *changed;
    EXPECT_EQ(scene.hair, set) << change;
  }
  const auto read_back = parse_scene(to_text(scene), "text", {});
  ASSERT_TRUE(read_back) << read_back.error().to_string();
  EXPECT_EQ(read_back->hair, set);
}

TEST(HairControls, EveryModelGetsStifferWithinItsRanges) {
  for (const SolverRow& row : solver_table()) {
    SCOPED_TRACE(row.name);
    const SolverParameters usual = complete_parameters(row, {}).value();
    EXPECT_EQ(stiff_parameters(row, usual, 1.0), usual);
    for (const double times : {0.1, 10.0}) {
      const SolverParameters other = stiff_parameters(row, usual, times);
      EXPECT_TRUE(complete_parameters(row, other)) << "within the row's ranges";
      EXPECT_NE(other, usual);
      for (const char* pull : {"style_stiffness_per_s2", "young_modulus_pa"})
        if (usual.contains(pull)) {
          EXPECT_DOUBLE_EQ(other.at(pull), times * usual.at(pull));
        }
    }
  }
}

// The qualities that are served: dftl pulls to the style, rods bend. In a breeze: a strong wind lays soft
// rods and usual ones alike along it.
TEST(HairControls, StifferHairGivesWayLessToTheSameWind) {
  for (const char* quality : {"quality=fast", "quality=full"}) {
    SCOPED_TRACE(quality);
    const SceneDesc usual = scene_with({quality, "wind.mean_mps={ x: 0 y: 0 z: -1.5 }"});
    const auto content = load_scene_content(usual);
    ASSERT_TRUE(content) << content.error().to_string();
    double before_m = 1.0;
    for (const double stiffness : {0.1, 1.0, 10.0}) {
      SceneDesc scene = usual;
      scene.hair.stiffness = stiffness;
      EXPECT_EQ(moves_otherwise(scene, usual), stiffness != 1.0);
      const double way_m = tip_way_m(scene, *content);
      EXPECT_LT(way_m, 0.8 * before_m) << stiffness;
      before_m = way_m;
    }
  }
}

TEST(HairControls, MoreWindCarriesHairFurtherAndNoneLeavesItStill) {
  const SceneDesc usual = scene_with({"quality=fast"});
  const auto content = load_scene_content(usual);
  ASSERT_TRUE(content) << content.error().to_string();
  double before_m = 0.0;
  for (const double wind : {0.0, 0.5, 1.0, 3.0}) {
    SceneDesc scene = usual;
    scene.hair.wind = wind;
    EXPECT_EQ(analyse(scene, {}).has_wind, wind > 0.0);
    EXPECT_EQ(analyse(scene, {.has_wind_stream = true}).has_wind, wind > 0.0);
    const double way_m = tip_way_m(scene, *content);
    if (wind == 0.0) {
      EXPECT_LT(way_m, 1e-3) << "as it was groomed";
    } else {
      EXPECT_GT(way_m, 1.2 * before_m) << wind;
    }
    before_m = std::max(way_m, 1e-3);
  }
}

TEST(HairControls, WindActsOnTheBreezeOnGustsAndOnAStream) {
  SceneDesc scene = scene_with({"wind.gust_intensity=0.5", "hair.wind=2"});
  SceneDesc usual = scene;
  usual.hair.wind = 1.0;
  InputFrame input;
  for (const bool has_stream : {false, true}) {
    input.has_wind_stream = has_stream;
    input.wind_mps = {1.0, 2.0, 3.0};
    const SceneFeatures features = analyse(scene, {.has_wind_stream = has_stream});
    StepBuilder twice(scene, {}), once(usual, {});
    const StepInput a = twice.build(input, features, 0.5).substeps.at(0);
    const StepInput b = once.build(input, features, 0.5).substeps.at(0);
    EXPECT_EQ(a.wind_mps, 2.0 * b.wind_mps);
    EXPECT_GT(glm::length(b.wind_mps), 0.0);
    ASSERT_EQ(a.gusts.size(), b.gusts.size());
    EXPECT_EQ(b.gusts.empty(), has_stream);
    for (size_t i = 0; i < a.gusts.size(); ++i) {
      EXPECT_EQ(a.gusts[i].amplitude_mps, 2.0f * b.gusts[i].amplitude_mps);
      EXPECT_EQ(a.gusts[i].phase_rad, b.gusts[i].phase_rad) << "the same gusts, at the same time";
    }
  }
}

TEST(HairControls, FrictionIsThatOfTheVolume) {
  SceneDesc scene = scene_with({"quality=full", "hair.friction=3"});
  const double usual = scene.volume.friction_per_s;
  EXPECT_GT(usual, 0.0);
  EXPECT_DOUBLE_EQ(moving_volume(scene, {}).friction_per_s, 3.0 * usual);
  SceneDesc slides = scene;
  slides.hair.friction = 0.0;
  EXPECT_EQ(moving_volume(slides, {}).friction_per_s, 0.0);
  EXPECT_TRUE(moves_otherwise(scene, slides));
}

TEST(HairControls, AnotherLengthOrCurlIsAnotherShapeAndNothingElseIs) {
  const SceneDesc scene = scene_with({});
  for (const HairControl& control : kHairControls) {
    SceneDesc other = scene;
    other.hair.*control.value = 0.5;
    const std::string name = control.name;
    EXPECT_EQ(is_shaped_otherwise(scene, other), name == "length" || name == "curl") << name;
  }
}

TEST(HairControls, LengthAndCurlAreThoseOfTheStrands) {
  const SceneDesc usual = scene_with({"quality=fast", "groom.procedural.curl_radius_m=0.01"});
  const auto groomed = load_scene_content(usual);
  ASSERT_TRUE(groomed);
  const auto with = [&](const char* what) {
    const auto content = load_scene_content(with_overrides(usual, {what}).value());
    EXPECT_TRUE(content);
    return content->groom;
  };
  const Groom half = with("hair.length=0.5"), combed = with("hair.curl=0");
  EXPECT_EQ(combed.rest_position_m, with("groom.procedural.curl_radius_m=0").rest_position_m)
      << "as if it had grown without curls";
  const auto turned = [](const Groom& groom, uint32_t strand) {
    double sum = 0.0;
    const glm::vec3* point = groom.rest_position_m.data() + groom.offset[strand];
    for (uint32_t i = 2; i < groom.vertex_count(strand); ++i) {
      const glm::vec3 a = glm::normalize(point[i - 1] - point[i - 2]),
                      b = glm::normalize(point[i] - point[i - 1]);
      sum += std::acos(std::clamp(static_cast<double>(glm::dot(a, b)), -1.0, 1.0));
    }
    return sum;
  };
  double turns = 0.0, combed_turns = 0.0;
  for (uint32_t s = 0; s < groomed->groom.strand_count(); ++s) {
    EXPECT_NEAR(half.length_m(s), 0.5 * groomed->groom.length_m(s), 0.005 * groomed->groom.length_m(s));
    turns += turned(groomed->groom, s);
    combed_turns += turned(combed, s);
  }
  EXPECT_LT(combed_turns, 0.7 * turns) << "what is left is the way about the head";
}

}  // namespace
}  // namespace strandcast::hair_controls_test
