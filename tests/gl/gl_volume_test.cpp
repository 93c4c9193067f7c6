// Hair volumes that OpenGL makes keep length and momentum, are what plain loops in double say, and are the
// same bits every time, however crowded.
#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "server/sim/executor/gl_executor.h"
#include "server/sim/executor/lanes_executor.h"
#include "server/sim/strand_layout.h"
#include "server/sim/volume/reference_volume.h"
#include "server/sim/volume/volume_forces.h"

namespace strandcast::gl_volume_test {
namespace {

using testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Strands of random steps from roots on a sphere, seen from a head that turns and moves.
struct Hair {
  StrandLayout layout;
  std::vector<glm::vec4> position_m;  // (vertex_count x strand_count) head-relative world axes
  std::vector<glm::vec4> velocity_mps;
  glm::dquat world_from_head = glm::normalize(glm::dquat(0.9, 0.3, -0.2, 0.1));
  glm::vec3 head_velocity_mps{0.4f, -1.2f, 0.3f};
  float h_s = 1.0f / 60.0f;

  StepBlock step() const {
    StepBlock block{};
    const glm::mat3 turn(glm::mat3_cast(world_from_head));
    for (int axis = 0; axis < 3; ++axis)
      block.world_from_head[static_cast<size_t>(axis)] = {turn[axis], 0.0f};
    block.head_velocity = {head_velocity_mps, h_s};
    block.push.w = 1.0f / h_s;
    block.shape = {layout.strand_count, layout.vertex_count, 1u, layout.vertex_count};
    return block;
  }
  /// On the host, which knows the grid.
  VolumeInput host_input(StrandBlocks& position, StrandBlocks& velocity) const {
    position = StrandBlocks(layout.strand_count, layout.vertex_count);
    velocity = StrandBlocks(layout.strand_count, layout.vertex_count);
    pack_blocks(std::span<const glm::vec4>(position_m), position);
    pack_blocks(std::span<const glm::vec4>(velocity_mps), velocity);
    VolumeInput input;
    input.position_m = position.view();
    input.velocity_mps = velocity.view();
    input.head_from_world = glm::mat3(glm::mat3_cast(glm::conjugate(world_from_head)));
    input.head_velocity_mps = head_velocity_mps;
    input.ahead_s = h_s;
    return input;
  }
  HairSample sample(size_t vertex) const {
    const glm::dvec3 moving = glm::dvec3(velocity_mps[vertex]) - glm::dvec3(head_velocity_mps);
    const glm::dvec3 at = glm::dvec3(position_m[vertex]) + static_cast<double>(h_s) * moving;
    return {glm::conjugate(world_from_head) * at, moving, 0.0};
  }
  /// Vertices with half of the segments beside them, or so many of each segment.
  std::vector<HairSample> samples(uint32_t of_segment) const {
    std::vector<HairSample> all;
    for (uint32_t strand = 0; strand < layout.strand_count; ++strand)
      for (uint32_t vertex = 0; vertex < layout.vertex_count; ++vertex) {
        const size_t at = layout.index(vertex, strand);
        const auto before_m = vertex == 0 ? 0.0 : static_cast<double>(layout.rest[at].w);
        if (of_segment == 1) {
          const bool is_last = vertex + 1 == layout.vertex_count;
          const auto after_m = is_last ? 0.0 : static_cast<double>(layout.rest[at + layout.strand_count].w);
          all.push_back(sample(at));
          all.back().length_m = 0.5 * (before_m + after_m);
        } else if (vertex > 0) {
          const HairSample from = sample(at - layout.strand_count);
          const HairSample to = sample(at);
          for (uint32_t i = 0; i < of_segment; ++i) {
            const double share = (i + 0.5) / of_segment;
            all.push_back({glm::mix(from.in_head_m, to.in_head_m, share),
                           glm::mix(from.velocity_mps, to.velocity_mps, share), before_m / of_segment});
          }
        }
      }
    return all;
  }
};

Hair random_hair(uint32_t strand_count, float step_m, uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  const auto vector = [&] { return glm::vec3(normal(random), normal(random), normal(random)); };
  Groom groom;
  groom.offset = {0};
  for (uint32_t strand = 0; strand < strand_count; ++strand) {
    glm::vec3 point = 0.1f * glm::normalize(vector());
    const glm::vec3 along = point * (step_m / 0.1f);
    for (uint32_t vertex = 0; vertex < 16; ++vertex) {
      groom.rest_position_m.push_back(point);
      groom.pinned.push_back(vertex == 0 ? 1 : 0);
      point += along + 0.3f * step_m * vector();
    }
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  Hair hair;
  hair.layout = *make_strand_layout(groom);
  for (const glm::vec4& rest : hair.layout.rest) {
    const glm::dvec3 moved = hair.world_from_head * glm::dvec3(rest) + 0.002 * glm::dvec3(vector());
    hair.position_m.emplace_back(glm::vec3(moved), 0.0f);
    hair.velocity_mps.emplace_back(hair.head_velocity_mps + vector(), 0.0f);
  }
  return hair;
}

struct Filled {
  DeviceVolumeFacts facts;
  std::vector<glm::vec4> nodes;
};

double length_in(const Filled& filled) {
  const auto cell_m = static_cast<double>(filled.facts.grid.cell_m);
  double sum = 0.0;
  for (const glm::vec4& node : filled.nodes) sum += static_cast<double>(node.w) * cell_m * cell_m * cell_m;
  return sum;
}

/// (length) x mean velocity of all nodes; of volumes that were not smoothed, all momentum there is.
glm::dvec3 momentum_in(const Filled& filled) {
  const auto cell_m = static_cast<double>(filled.facts.grid.cell_m);
  glm::dvec3 sum(0.0);
  for (const glm::vec4& node : filled.nodes)
    sum += static_cast<double>(node.w) * cell_m * cell_m * cell_m * glm::dvec3(node);
  return sum;
}

class GlVolumes : public testing::TestWithParam<std::string> {
 protected:
  GlVolumes() : executor_(std::move(make_gl_executor("auto")).value()) {}

  /// A volume of such hair, which others may be put into one after the other.
  struct Maker {
    HairVolume host;
    std::unique_ptr<DeviceVolume> volume;
    std::unique_ptr<LookupTable> table;
    StrandBlocks position_blocks, velocity_blocks;
  };
  Maker make(const Hair& hair, const VolumeOptions& options, bool has_way = false) {
    Maker maker{
        HairVolume::make({hair.layout.strand_count, hair.layout.vertex_count, hair.layout.rest, {}}, options)
            .value(),
        nullptr,
        nullptr,
        {},
        {}};
    DeviceVolumeDesc desc;
    desc.scatter = GetParam();
    desc.volume = &maker.host;
    desc.strand_count = hair.layout.strand_count;
    desc.vertex_count = hair.layout.vertex_count;
    desc.smoothing = options.smoothing;
    desc.has_way = has_way;
    auto volume = executor_->make_volume(desc);
    EXPECT_TRUE(volume) << volume.error().to_string();
    maker.volume = std::move(volume).value();
    maker.table = executor_->make_table("volume", static_cast<uint32_t>(2 + maker.host.most_nodes())).value();
    return maker;
  }
  Filled fill(Maker& maker, const Hair& hair) {
    const auto position = executor_->make_plane("position", hair.layout.strand_count, hair.position_m);
    const auto velocity = executor_->make_plane("velocity", hair.layout.strand_count, hair.velocity_mps);
    maker.volume->update(hair.step(), *position, *velocity, *maker.table);
    Filled filled{maker.volume->read_facts(), {}};
    maker.volume->read_nodes(*maker.table, filled.nodes);
    return filled;
  }
  Filled fill(const Hair& hair, const VolumeOptions& options) {
    Maker maker = make(hair, options);
    return fill(maker, hair);
  }
  static VolumeGrid host_grid(Maker& maker, const Hair& hair) {
    std::vector<glm::vec4> nodes(maker.host.most_nodes());
    maker.host.update(hair.host_input(maker.position_blocks, maker.velocity_blocks), nodes);
    return maker.host.grid();
  }

  /// Density and velocity of all nodes against plain loops in double.
  static void expect_as_in_double(const Filled& filled, const std::vector<HairSample>& samples,
                                  uint32_t smoothing) {
    const ReferenceVolume reference = make_reference_volume(filled.facts.grid, samples, smoothing);
    double density_error = 0.0, density = 0.0, velocity_error = 0.0, velocity = 0.0;
    for (size_t i = 0; i < reference.nodes.size(); ++i) {
      const glm::dvec4 difference = glm::dvec4(filled.nodes[i]) - reference.nodes[i];
      density_error += difference.w * difference.w;
      density += reference.nodes[i].w * reference.nodes[i].w;
      // Weighed with the hair that is there: where there is hardly any, a mean is of rounding.
      const glm::dvec3 off(difference);
      velocity_error += reference.nodes[i].w * glm::dot(off, off);
      const glm::dvec3 mean(reference.nodes[i]);
      velocity += reference.nodes[i].w * glm::dot(mean, mean);
    }
    EXPECT_LT(std::sqrt(density_error / density), 1e-5);
    EXPECT_LT(std::sqrt(velocity_error / velocity), 1e-4);
  }

  std::unique_ptr<Executor> executor_;
};

TEST_P(GlVolumes, AreWhatPlainLoopsInDoubleSay) {
  for (const auto& [step_m, resolution] : {std::pair{0.006f, 20u}, {0.012f, 48u}}) {
    const Hair hair = random_hair(700, step_m, 4);
    for (const uint32_t smoothing : {0u, 1u, 2u}) {
      SCOPED_TRACE(testing::Message() << resolution << ' ' << smoothing);
      Maker maker = make(hair, {resolution, smoothing});
      const Filled filled = fill(maker, hair);
      EXPECT_EQ(filled.facts.grid, host_grid(maker, hair)) << "the same grid as on the host";
      EXPECT_EQ(filled.facts.outside_count, 0u);
      const uint32_t of_segment = maker.host.segment_samples();
      EXPECT_EQ(of_segment > 1, resolution == 48);
      const std::vector<HairSample> samples = hair.samples(of_segment);
      expect_as_in_double(filled, samples, smoothing);
      EXPECT_NEAR(length_in(filled) / maker.host.length_m(), 1.0, 1e-6);
      if (smoothing > 0) continue;
      glm::dvec3 momentum(0.0);
      double size = 0.0;
      for (const HairSample& sample : samples) {
        momentum += sample.length_m * sample.velocity_mps;
        size += sample.length_m * glm::length(sample.velocity_mps);
      }
      EXPECT_LT(glm::distance(momentum_in(filled), momentum) / size, 1e-6);
    }
  }
}

// What friction takes out by interpolating is what the sums put in.
TEST_P(GlVolumes, GiveBackMomentum) {
  const Hair hair = random_hair(500, 0.004f, 2);
  for (const uint32_t smoothing : {1u, 3u}) {
    const Filled filled = fill(hair, {24, smoothing});
    glm::dvec3 momentum(0.0), given_back(0.0);
    double size = 0.0;
    for (const HairSample& sample : hair.samples(1)) {
      const VolumeSample found = sample_volume(filled.facts.grid, filled.nodes, sample.in_head_m);
      ASSERT_TRUE(found.is_inside);
      momentum += sample.length_m * sample.velocity_mps;
      given_back += sample.length_m * found.velocity_mps;
      size += sample.length_m * glm::length(sample.velocity_mps);
    }
    EXPECT_LT(glm::distance(momentum, given_back) / size, 1e-6) << smoothing;
  }
}

// Nothing is left of what was there before, wherever the grid went, and nothing depends on who came first.
TEST_P(GlVolumes, AreTheSameBitsEveryTime) {
  const Hair hair = random_hair(900, 0.006f, 7);
  Hair elsewhere = random_hair(900, 0.006f, 8);
  for (glm::vec4& point : elsewhere.position_m) point = {1.5f * glm::vec3(point) + glm::vec3(0.1f), 0.0f};
  const Filled first = fill(hair, {24, 1});
  Maker maker = make(hair, {24, 1});
  for (int i = 0; i < 3; ++i) {
    fill(maker, elsewhere);
    const Filled again = fill(maker, hair);
    ASSERT_EQ(again.facts.grid, first.facts.grid);
    ASSERT_EQ(std::memcmp(again.nodes.data(), first.nodes.data(), first.nodes.size() * sizeof(glm::vec4)), 0)
        << i;
  }
}

// More than a loop of llvmpipe turns, with one strand far off that makes the grid what it is.
TEST_P(GlVolumes, HoldAllHairInOneCell) {
  Hair hair = random_hair(4400, 0.006f, 5);
  const glm::dvec3 middle = hair.sample(hair.layout.index(3, 0)).in_head_m;
  // Together, against which roundings show: of motion to and fro nothing much is left on the mean.
  for (glm::vec4& velocity : hair.velocity_mps) velocity += glm::vec4(0.5f, -0.8f, 0.3f, 0.0f);
  std::mt19937 random(9);
  std::uniform_real_distribution<float> uniform(0.1f, 0.9f);
  Maker maker = make(hair, {24, 0});
  ASSERT_EQ(maker.host.segment_samples(), 1u);
  const float cell_m = maker.host.cell_m();
  const glm::vec3 corner = glm::floor(glm::vec3(middle) / cell_m) * cell_m;
  for (size_t i = 0; i < hair.layout.size(); ++i) {
    const glm::vec3 in_head = corner + cell_m * glm::vec3(uniform(random), uniform(random), uniform(random));
    const glm::dvec3 moved =
        glm::dvec3(hair.h_s) * glm::dvec3(hair.velocity_mps[i] - glm::vec4(hair.head_velocity_mps, 0.0f));
    hair.position_m[i] = glm::vec4(glm::vec3(hair.world_from_head * glm::dvec3(in_head) - moved), 0.0f);
  }
  ASSERT_GT(hair.layout.size(), 70'000u);
  const Filled filled = fill(maker, hair);
  EXPECT_EQ(filled.facts.outside_count, 0u);
  EXPECT_NEAR(length_in(filled) / maker.host.length_m(), 1.0, 1e-6);
  expect_as_in_double(filled, hair.samples(1), 0);
  const Filled again = fill(maker, hair);
  EXPECT_EQ(std::memcmp(again.nodes.data(), filled.nodes.data(), filled.nodes.size() * sizeof(glm::vec4)), 0);
}

// The most that can come to a node: equal lengths just below a power of two, and all hair of a mind.
TEST_P(GlVolumes, HoldAllHairOnOneNode) {
  constexpr float kBelowPowerOfTwo = 0.0078f;
  const glm::vec3 moving(0.999f, -0.999f, 0.5f);
  Hair hair = random_hair(4400, 0.006f, 13);
  for (size_t i = hair.layout.strand_count; i < hair.layout.size(); ++i)
    hair.layout.rest[i].w = kBelowPowerOfTwo;
  Maker maker = make(hair, {20, 0});
  ASSERT_EQ(maker.host.segment_samples(), 1u);
  const glm::dvec3 node = glm::dvec3(maker.host.cell_m()) * glm::dvec3(3.0, 2.0, -4.0);
  for (size_t i = 0; i < hair.layout.size(); ++i) {
    hair.velocity_mps[i] = glm::vec4(hair.head_velocity_mps + moving, 0.0f);
    const glm::dvec3 at = hair.world_from_head * node - glm::dvec3(hair.h_s * moving);
    hair.position_m[i] = glm::vec4(glm::vec3(at), 0.0f);
  }
  const Filled filled = fill(maker, hair);
  EXPECT_EQ(filled.facts.outside_count, 0u);
  EXPECT_NEAR(length_in(filled) / maker.host.length_m(), 1.0, 1e-6);
  const VolumeSample found = sample_volume(filled.facts.grid, filled.nodes, node);
  EXPECT_LT(glm::distance(found.velocity_mps, glm::dvec3(moving)), 1e-5);
}

// As many cells in use as there can be.
TEST_P(GlVolumes, HoldEachVertexInACellOfItsOwn) {
  Hair hair = random_hair(1000, 0.006f, 6);
  Maker maker = make(hair, {28, 0});
  ASSERT_EQ(maker.host.segment_samples(), 1u);
  const float cell_m = maker.host.cell_m();
  for (size_t i = 0; i < hair.layout.size(); ++i) {
    const auto cell = static_cast<uint32_t>(i);  // 25 x 25 x 26 of them
    const glm::vec3 at(cell % 25, cell / 25 % 25, cell / 625);
    const glm::dvec3 in_head = glm::dvec3(cell_m * (at - 12.0f + glm::vec3(0.3f, 0.5f, 0.6f)));
    const glm::dvec3 moved =
        glm::dvec3(hair.h_s) * glm::dvec3(hair.velocity_mps[i] - glm::vec4(hair.head_velocity_mps, 0.0f));
    hair.position_m[i] = glm::vec4(glm::vec3(hair.world_from_head * in_head - moved), 0.0f);
  }
  const Filled filled = fill(maker, hair);
  EXPECT_EQ(filled.facts.outside_count, 0u);
  EXPECT_NEAR(length_in(filled) / maker.host.length_m(), 1.0, 1e-6);
  expect_as_in_double(filled, hair.samples(1), 0);
}

// What is no number, or beyond reach, is counted and harms nobody; what flies far is cut off as on the host.
TEST_P(GlVolumes, CountWhatIsOutside) {
  Hair hair = random_hair(300, 0.006f, 11);
  const auto put = [&](uint32_t strand, float to) {
    for (uint32_t vertex = 1; vertex < 16; ++vertex)
      hair.position_m[hair.layout.index(vertex, strand)] = glm::vec4(to);
  };
  put(3, kNan);
  put(17, 1e30f);
  put(18, std::numeric_limits<float>::infinity());
  hair.velocity_mps[hair.layout.index(5, 29)].y = kNan;
  Maker maker = make(hair, {20, 1});
  Filled filled = fill(maker, hair);
  EXPECT_EQ(filled.facts.grid, host_grid(maker, hair));
  EXPECT_EQ(filled.facts.outside_count, 3u * 15 + 1);
  EXPECT_EQ(filled.facts.outside_count, maker.host.outside_count());
  for (const glm::vec4& node : filled.nodes) ASSERT_TRUE(std::isfinite(glm::dot(node, node)));
  put(40, 4.0f);  // within reach, and by far too far for the grid
  filled = fill(maker, hair);
  EXPECT_EQ(filled.facts.grid, host_grid(maker, hair));
  EXPECT_EQ(filled.facts.outside_count, maker.host.outside_count());
  EXPECT_GE(filled.facts.outside_count, 4u * 15 + 1);
}

// A model that keeps ways: those times the rate of steps are the velocities.
TEST_P(GlVolumes, GoByWays) {
  Hair hair = random_hair(200, 0.006f, 12);
  const Filled by_velocity = fill(hair, {16, 1});
  Maker maker = make(hair, {16, 1}, true);
  for (glm::vec4& velocity : hair.velocity_mps) velocity *= hair.h_s;
  const Filled by_way = fill(maker, hair);
  ASSERT_EQ(by_way.facts.grid, by_velocity.facts.grid);
  double error = 0.0, size = 0.0;
  for (size_t i = 0; i < by_way.nodes.size(); ++i) {
    const glm::dvec4 off = glm::dvec4(by_way.nodes[i]) - glm::dvec4(by_velocity.nodes[i]);
    error += by_velocity.nodes[i].w * glm::dot(glm::dvec3(off), glm::dvec3(off));
    size +=
        by_velocity.nodes[i].w * glm::dot(glm::dvec3(by_velocity.nodes[i]), glm::dvec3(by_velocity.nodes[i]));
  }
  EXPECT_LT(std::sqrt(error / size), 1e-5);
}

INSTANTIATE_TEST_SUITE_P(Scatters, GlVolumes, testing::Values("sort", "atomics"),
                         [](const auto& name) { return name.param; });

TEST(VolumeScatters, AreRefusedWhereTheyAreNotThere) {
  const Hair hair = random_hair(20, 0.006f, 1);
  VolumeDesc desc;
  desc.friction_per_s = 20.0;
  desc.scatter = "sort";
  const auto lanes = make_lanes_executor().value();
  const auto refused = VolumeForces::make(*lanes, {}, hair.layout, desc, nullptr);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("volume.scatter: sort needs OpenGL"));
  const auto gl = make_gl_executor("auto").value();
  desc.target_per_s2 = 10.0;
  const auto extras = VolumeForces::make(*gl, {}, hair.layout, desc, nullptr);
  ASSERT_FALSE(extras);
  EXPECT_THAT(extras.error().message, HasSubstr("volume.target_per_s2"));
  desc.scatter = "auto";
  const auto on_host = VolumeForces::make(*gl, {}, hair.layout, desc, nullptr);
  ASSERT_TRUE(on_host);
  EXPECT_EQ((*on_host)->scatter(), "host");
  desc.target_per_s2 = 0.0;
  EXPECT_EQ((*VolumeForces::make(*gl, {}, hair.layout, desc, nullptr))->scatter(),
            gl->info().is_software ? "host" : "sort");
  EXPECT_EQ((*VolumeForces::make(*lanes, {}, hair.layout, desc, nullptr))->scatter(), "host");
}

}  // namespace
}  // namespace strandcast::gl_volume_test
