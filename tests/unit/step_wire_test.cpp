// What the "step" codec writes in front of its symbols, as proto/WIRE.md lays it out.
#include "common/strands/step/wire.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>

#include "common/scene/scene_file.h"
#include "tests/support/sim_scene.h"
#include "tests/support/stepped_hair.h"

namespace strandcast::step_wire_test {
namespace {

constexpr uint32_t kStrands = kWalkingStrands;
constexpr uint32_t kVertices = kWalkingVertices;

/// What reading bytes gives after some of them were replaced from `at` on.
template <class Read, class Value>
ErrorCode code_of(std::vector<std::byte> bytes, size_t at, Value value, Read read) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
  ByteReader reader(bytes);
  const auto result = read(reader);
  return result ? ErrorCode::Internal : result.error().code;
}

// Layout in proto/WIRE.md.
TEST(StepWire, RefusesWhatNoStepCanBe) {
  const double kNoNumber = std::nan("");
  SteppedHair hair = walking_hair("pbd");
  const StepTrail trail = *hair.step().snapshot.trail;
  const auto read_model = [&](ByteReader& reader) {
    return step::read_model(reader, hair.rest_in_head_m(), kStrands, kVertices);
  };
  std::vector<std::byte> model;
  step::write_model(*trail.model, hair.rest_in_head_m(), kStrands, model);
  ByteReader good(model);
  ASSERT_TRUE(read_model(good));
  EXPECT_TRUE(good.rest().empty());
  EXPECT_EQ(code_of(model, 0, uint8_t{63}, read_model), ErrorCode::Unsupported);
  EXPECT_EQ(code_of(model, 2, uint8_t{0}, read_model), ErrorCode::BadInput);
  EXPECT_EQ(code_of(model, 3, uint8_t{kVertices}, read_model), ErrorCode::BadInput);
  EXPECT_EQ(code_of(model, 4, kNoNumber, read_model), ErrorCode::BadInput);
  constexpr size_t kConstantsAt = 4 + 9 * sizeof(double);
  EXPECT_EQ(code_of(model, kConstantsAt, uint8_t{255}, read_model), ErrorCode::LimitExceeded);
  StepModel many = *trail.model;
  many.kernel.constants["u_iterations"] = step::kMostRounds + 1;
  std::vector<std::byte> rounds;
  step::write_model(many, hair.rest_in_head_m(), kStrands, rounds);
  EXPECT_EQ(code_of(rounds, 0, rounds[0], read_model), ErrorCode::LimitExceeded);

  StepModel with_volume = *trail.model;
  with_volume.volume.friction_per_s = 20.0;
  std::vector<std::byte> volume;
  step::write_model(with_volume, hair.rest_in_head_m(), kStrands, volume);
  ByteReader good_volume(volume);
  const auto with_volume_read = read_model(good_volume);
  ASSERT_TRUE(with_volume_read);
  EXPECT_EQ(with_volume_read->volume, with_volume.volume);
  for (const uint8_t resolution : {7, 65})
    EXPECT_EQ(code_of(volume, volume.size() - 3, resolution, read_model), ErrorCode::LimitExceeded);
  EXPECT_EQ(code_of(volume, volume.size() - 2, uint8_t{4}, read_model), ErrorCode::LimitExceeded);
  EXPECT_EQ(code_of(volume, volume.size() - 3 - 5 * sizeof(double), kNoNumber, read_model),
            ErrorCode::BadInput);
  EXPECT_EQ(code_of(volume, volume.size() - 3 - 5 * sizeof(double), -1.0, read_model), ErrorCode::BadInput);
  volume.resize(volume.size() - 1);
  EXPECT_EQ(code_of(volume, 0, volume[0], read_model), ErrorCode::BadInput);

  StepModel with_air = with_volume;
  with_air.volume.air.acts = true;
  with_air.volume.air.has_wind = false;
  with_air.volume.air.hairs = 77'000.0;
  std::vector<std::byte> air;
  step::write_model(with_air, hair.rest_in_head_m(), kStrands, air);
  ByteReader good_air(air);
  EXPECT_EQ(read_model(good_air)->volume, with_air.volume);
  for (size_t i = 1; i <= 4; ++i)
    for (const double value : {0.0, -1.0, 1e9, kNoNumber})
      EXPECT_EQ(code_of(air, air.size() - i * sizeof(double), value, read_model), ErrorCode::BadInput) << i;
  air.resize(air.size() - 1);
  EXPECT_EQ(code_of(air, 0, air[0], read_model), ErrorCode::BadInput);

  std::vector<std::byte> scene;
  step::write_scene(*trail.scene, scene);
  const auto read_scene = [](ByteReader& reader) { return step::read_scene(reader); };
  EXPECT_EQ(code_of(scene, 0, kNoNumber, read_scene), ErrorCode::BadInput);
  for (const uint8_t substeps : {0, 65})
    EXPECT_EQ(code_of(scene, sizeof(double), substeps, read_scene), ErrorCode::LimitExceeded);
  constexpr size_t kCollidersAt = sizeof(double) + 1 + 7 * sizeof(double) + 2 * sizeof(float);
  EXPECT_EQ(code_of(scene, kCollidersAt, uint8_t{255}, read_scene), ErrorCode::LimitExceeded);
  scene.resize(scene.size() - 1);
  EXPECT_EQ(code_of(scene, 0, scene[0], read_scene), ErrorCode::BadInput);

  StepModel beside = *trail.model;
  beside.bend = BendAngles{.most_root_rad = 1.0};
  beside.drag_along_share = 0.5;
  beside.meets_body = true;
  ToldField field{{glm::vec3(0.0f), 0.01f, glm::uvec3(3, 4, 5)}, {}};
  for (int i = 0; i < 60; ++i) field.distance.push_back(static_cast<int16_t>((i * 7919) % 4001 - 2000));
  beside.field = std::make_shared<ToldField>(field);
  std::vector<std::byte> besides;
  step::write_model(beside, hair.rest_in_head_m(), kStrands, besides);
  ByteReader good_besides(besides);
  const auto besides_read = read_model(good_besides);
  ASSERT_TRUE(besides_read) << besides_read.error().to_string();
  EXPECT_TRUE(good_besides.rest().empty());
  EXPECT_EQ(besides_read->bend, beside.bend);
  EXPECT_EQ(besides_read->drag_along_share, 0.5);
  EXPECT_TRUE(besides_read->meets_body);
  EXPECT_EQ(besides_read->field->grid, field.grid);
  // Eight steps at a time within a cell of the skin, 128 beyond it.
  ASSERT_EQ(besides_read->field->distance.size(), field.distance.size());
  for (size_t i = 0; i < field.distance.size(); ++i)
    EXPECT_NEAR(besides_read->field->distance[i], field.distance[i],
                std::abs(field.distance[i]) < 640 ? 4 : 64);
  const size_t flags_at = model.size();
  EXPECT_EQ(code_of(besides, flags_at, uint8_t{0x3f}, read_model), ErrorCode::Unsupported);
  EXPECT_EQ(code_of(besides, flags_at, uint8_t{0x1f}, read_model), ErrorCode::Unsupported) << "two fields";
  EXPECT_EQ(code_of(besides, flags_at + 1, kNoNumber, read_model), ErrorCode::BadInput);
  EXPECT_EQ(code_of(besides, flags_at + 1, 4.0, read_model), ErrorCode::BadInput) << "an angle above pi";
  const size_t drag_at = flags_at + 1 + 4 * sizeof(double), grid_at = drag_at + sizeof(double);
  EXPECT_EQ(code_of(besides, drag_at, 1.5, read_model), ErrorCode::BadInput);
  EXPECT_EQ(code_of(besides, grid_at + 3 * sizeof(float), 0.0f, read_model), ErrorCode::LimitExceeded);
  EXPECT_EQ(code_of(besides, grid_at + 4 * sizeof(float), uint16_t{1}, read_model), ErrorCode::LimitExceeded);
  std::vector<std::byte> huge = besides;
  for (size_t axis = 0; axis < 3; ++axis) huge[grid_at + 4 * sizeof(float) + 2 * axis + 1] = std::byte{1};
  EXPECT_EQ(code_of(huge, 0, huge[0], read_model), ErrorCode::LimitExceeded);
  besides.resize(besides.size() - 1);
  EXPECT_EQ(code_of(besides, 0, besides[0], read_model), ErrorCode::BadInput);

  StepScene with_body = *trail.scene;
  with_body.body.capsules.resize(2);
  with_body.body.planes.resize(1);
  std::vector<std::byte> body;
  step::write_scene(with_body, body);
  const size_t body_at = scene.size() + 1;
  EXPECT_EQ(code_of(body, body_at, uint8_t{17}, read_scene), ErrorCode::LimitExceeded);
  const size_t planes_at = body_at + 1 + 4 * sizeof(float);
  EXPECT_EQ(code_of(body, planes_at, uint8_t{5}, read_scene), ErrorCode::LimitExceeded);
  EXPECT_EQ(code_of(body, planes_at + 1 + 3 * sizeof(double), 7.0, read_scene), ErrorCode::BadInput);
  EXPECT_EQ(code_of(body, planes_at + 1 + 9 * sizeof(double), uint8_t{4}, read_scene), ErrorCode::BadInput);
  body.resize(body.size() - 1);
  EXPECT_EQ(code_of(body, 0, body[0], read_scene), ErrorCode::BadInput);

  step::TickBase base;
  std::vector<std::byte> ticks;
  step::write_ticks(trail.ticks, *trail.scene, base, ticks);
  const auto read_ticks = [&](ByteReader& reader) {
    step::TickBase from;
    return step::read_ticks(reader, {100, Pose{}}, *trail.scene, from);
  };
  EXPECT_EQ(code_of(ticks, 0, static_cast<uint8_t>(kMostTrailTicks + 1), read_ticks),
            ErrorCode::LimitExceeded);
  EXPECT_EQ(code_of(ticks, 1, uint8_t{0x80}, read_ticks), ErrorCode::BadInput);
  ticks.resize(ticks.size() - 1);
  EXPECT_EQ(code_of(ticks, 0, ticks[0], read_ticks), ErrorCode::BadInput);
}

TEST(StepWire, WhatIsReadIsWhatWasWritten) {
  SteppedHair hair = walking_hair("direct_rod");
  const StepTrail trail = *hair.step().snapshot.trail;
  std::vector<std::byte> bytes;
  step::write_scene(*trail.scene, bytes);
  ByteReader reader(bytes);
  const auto scene = step::read_scene(reader);
  ASSERT_TRUE(scene);
  EXPECT_EQ(*scene, *trail.scene);
  StepScene with_body = *trail.scene;
  with_body.body.capsules.resize(2);
  with_body.body.capsules[1].to_radius_m = 0.125;
  with_body.body.capsules[0].from_radius_m = with_body.body.capsules[0].to_radius_m = 0.25;
  with_body.body.capsules[1].from_radius_m = 0.5;
  with_body.body.planes = {{{0.0, -0.2, 0.1}, {0.0, 0.6, 0.8}, {0.001, 0.0, 0.0}}};
  with_body.body.response = BodyResponse::Sphere;
  std::vector<std::byte> body_bytes;
  step::write_scene(with_body, body_bytes);
  ByteReader body_reader(body_bytes);
  const auto body_scene = step::read_scene(body_reader);
  ASSERT_TRUE(body_scene) << body_scene.error().to_string();
  EXPECT_EQ(*body_scene, with_body);
  // Where capsules are, to the step in which it is told, beside where they were.
  std::vector<StepTick> ticks(3);
  for (size_t i = 0; i < ticks.size(); ++i) {
    ticks[i].tick = 10 + i;
    ticks[i].has_body = true;
    for (int point = 0; point < 4; ++point)
      ticks[i].body_m.emplace_back(0.1 * point, -0.2 + 0.01 * static_cast<double>(i), 1.0 / 3.0);
  }
  ticks[2].is_body_new = true;
  step::TickBase to, from;
  std::vector<std::byte> tick_bytes;
  step::write_ticks(ticks, with_body, to, tick_bytes);
  ByteReader tick_reader(tick_bytes);
  const auto read = step::read_ticks(tick_reader, {12, ticks[2].world_from_head}, with_body, from);
  ASSERT_TRUE(read) << read.error().to_string();
  EXPECT_EQ(to.body, from.body);
  ASSERT_EQ(read->size(), ticks.size());
  constexpr double kStepM = 1.0 / 65536.0;
  for (size_t i = 0; i < ticks.size(); ++i) {
    ASSERT_EQ((*read)[i].body_m.size(), 4u);
    for (size_t point = 0; point < 4; ++point)
      EXPECT_LT(glm::distance((*read)[i].body_m[point], ticks[i].body_m[point]), kStepM);
    EXPECT_EQ((*read)[i].body_before_m, i == 1 ? (*read)[0].body_m : std::vector<glm::dvec3>());
  }
  // Of another body nothing is said.
  with_body.body.capsules.resize(1);
  std::vector<std::byte> other;
  step::write_ticks(ticks, with_body, to, other);
  ByteReader other_reader(other);
  const auto unsaid = step::read_ticks(other_reader, {12, ticks[2].world_from_head}, with_body, from);
  ASSERT_TRUE(unsaid);
  for (const StepTick& tick : *unsaid) EXPECT_FALSE(tick.has_body);
  // Rods to the step in which they are told.
  std::vector<std::byte> model_bytes;
  step::write_model(*trail.model, hair.rest_in_head_m(), kStrands, model_bytes);
  ByteReader model_reader(model_bytes);
  const auto model = step::read_model(model_reader, hair.rest_in_head_m(), kStrands, kVertices);
  ASSERT_TRUE(model);
  EXPECT_EQ(model->kernel, trail.model->kernel);
  ASSERT_EQ(model->rod_edge.size(), trail.model->rod_edge.size());
  for (size_t i = 0; i < model->rod_edge.size(); ++i) {
    EXPECT_LT(glm::distance(glm::vec3(model->rod_edge[i]), glm::vec3(trail.model->rod_edge[i])), 2e-4f);
    EXPECT_EQ(model->rod_edge[i].w, trail.model->rod_edge[i].w);
  }
  for (size_t i = 0; i < 2 * kStrands; ++i)
    EXPECT_LT(glm::distance(glm::vec3(model->rod_strand[i]), glm::vec3(trail.model->rod_strand[i])), 2e-4f);
  for (size_t i = 2 * kStrands; i < 4 * kStrands; ++i)
    EXPECT_NEAR(model->rod_strand[i].w / trail.model->rod_strand[i].w, 1.0f, 1e-3f);
}

// Which tips are pinned is told by strand; rods of both kinds follow from it.
TEST(StepWire, TipsArePinnedByStrand) {
  SteppedHair hair = walking_hair("direct_rod");
  StepModel mixed = *hair.step().snapshot.trail->model;
  mixed.pinned_tail_count = 2;
  for (uint32_t s = 0; s < kStrands; ++s) mixed.has_tail.push_back(s % 3 == 0 ? 1 : 0);
  const auto read_model = [&](ByteReader& reader) {
    return step::read_model(reader, hair.rest_in_head_m(), kStrands, kVertices);
  };
  std::vector<std::byte> bytes;
  step::write_model(mixed, hair.rest_in_head_m(), kStrands, bytes);
  ByteReader reader(bytes);
  const auto model = read_model(reader);
  ASSERT_TRUE(model) << model.error().to_string();
  EXPECT_TRUE(reader.rest().empty());
  EXPECT_EQ(model->has_tail, mixed.has_tail);
  EXPECT_EQ(model->pinned_tail_count, 2u);
  EXPECT_EQ(code_of(bytes, 3, uint8_t{0}, read_model), ErrorCode::BadInput) << "pins nothing";
  bytes.resize(5);
  ByteReader cut(bytes);
  EXPECT_EQ(read_model(cut).error().code, ErrorCode::BadInput);
}

// Joints of a rod whose rest shape carries its weight follow from that weight.
TEST(StepWire, TellsRodsBesideTheirWeight) {
  constexpr size_t kMostBytesAStrand = 24;  // of 14 joints and a clamp
  SceneDesc scene = built_in_scene_with({"quality=full"}).value();
  std::get<ProceduralGroomDesc>(scene.groom).strand_count = 400;
  SteppedHair hair(scene);
  const StepTrail trail = *hair.step().snapshot.trail;
  StepModel model = *trail.model;
  model.field = nullptr;
  ASSERT_NE(trail.scene->groom_gravity_in_head_mps2, glm::dvec3(0.0));
  std::vector<std::byte> told, apart;
  step::write_model(model, hair.rest_in_head_m(), 400, told, trail.scene->groom_gravity_in_head_mps2);
  step::write_model(model, hair.rest_in_head_m(), 400, apart);
  EXPECT_LT(told.size(), 400 * kMostBytesAStrand / 4);
  EXPECT_GT(apart.size(), 400 * kMostBytesAStrand);
  for (const auto* bytes : {&told, &apart}) {
    ByteReader reader(*bytes);
    const auto read = step::read_model(reader, hair.rest_in_head_m(), 400, hair.vertex_count());
    ASSERT_TRUE(read) << read.error().to_string();
    for (size_t i = 0; i < read->rod_edge.size(); ++i)
      ASSERT_LT(glm::distance(glm::vec3(read->rod_edge[i]), glm::vec3(model.rod_edge[i])), 2e-4f);
  }
}

}  // namespace
}  // namespace strandcast::step_wire_test
