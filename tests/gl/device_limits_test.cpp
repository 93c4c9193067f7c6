#include "common/gl/device_limits.h"

#include <epoxy/gl.h>

#include <filesystem>
#include <map>
#include <set>

#include "common/base/file.h"
#include "common/gl/program.h"
#include "tests/support/gl_fixture.h"
#include "tests/support/test_grid.h"

namespace strandcast::gl::device_limits_test {
namespace {

using testing::HasSubstr;

const DeviceLimitRow& row_of(DeviceLimit limit) {
  return device_limit_table()[static_cast<size_t>(limit)];
}

/// A device that offers what OpenGL 4.5 guarantees, and what we need beyond it.
DeviceLimits just_enough() {
  DeviceLimits limits;
  for (const DeviceLimitRow& row : device_limit_table())
    limits.values[static_cast<size_t>(row.limit)] = std::max(row.guaranteed, row.needed);
  return limits;
}

TEST(DeviceLimits, JustEnoughIsEnough) {
  EXPECT_TRUE(check_device_limits(just_enough()));
}

TEST(DeviceLimits, OneTooLittleOfAnyIsRefusedWithItsNameAndBothNumbers) {
  for (const DeviceLimitRow& row : device_limit_table()) {
    if (row.needed == 0) continue;
    DeviceLimits limits = just_enough();
    limits.values[static_cast<size_t>(row.limit)] = row.needed - 1;
    const auto checked = check_device_limits(limits);
    ASSERT_FALSE(checked) << row.name;
    EXPECT_EQ(checked.error().code, ErrorCode::Unsupported);
    EXPECT_EQ(checked.error().message, fmt::format("{} needs {} {}, this device has {}", row.user, row.needed,
                                                   row.name, row.needed - 1));
  }
}

TEST(DeviceLimits, WhatOpenGlGuaranteesDoesNotReachTheVertexStage) {
  DeviceLimits limits;
  for (const DeviceLimitRow& row : device_limit_table())
    limits.values[static_cast<size_t>(row.limit)] = row.guaranteed;
  const auto checked = check_device_limits(limits);
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().message,
            "render/strand.vert needs 2 storage blocks in the vertex stage, this device has 0");
}

TEST(DeviceLimits, SizesOfTheSceneAreCheckedInTheSameWords) {
  DeviceLimits limits = just_enough();
  limits.values[static_cast<size_t>(DeviceLimit::BufferTexels)] = 65'536;
  EXPECT_TRUE(check_device_limit(limits, DeviceLimit::BufferTexels, 65'536, "a groom"));
  const auto checked = check_device_limit(limits, DeviceLimit::BufferTexels, 65'537, "a groom");
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(checked.error().message, "a groom needs 65537 texels in a buffer texture, this device has 65536");
}

/// The most that any linked program uses, by limit.
using Used = std::map<DeviceLimit, uint64_t>;

GLint property_of(uint32_t program, GLenum interface, GLuint index, GLenum property) {
  GLint value = 0;
  glGetProgramResourceiv(program, interface, index, 1, &property, 1, nullptr, &value);
  return value;
}

GLint count_of(uint32_t program, GLenum interface) {
  GLint count = 0;
  glGetProgramInterfaceiv(program, interface, GL_ACTIVE_RESOURCES, &count);
  return count;
}

void raise(Used& used, DeviceLimit limit, uint64_t value) {
  used[limit] = std::max(used[limit], value);
}

void add_blocks(uint32_t program, Used& used) {
  uint64_t in_vertex = 0, in_fragment = 0, in_tessellation = 0, in_compute = 0;
  const auto blocks = static_cast<GLuint>(count_of(program, GL_SHADER_STORAGE_BLOCK));
  for (GLuint i = 0; i < blocks; ++i) {
    const auto is_in = [&](GLenum stage) {
      return property_of(program, GL_SHADER_STORAGE_BLOCK, i, stage) != 0 ? 1u : 0u;
    };
    in_vertex += is_in(GL_REFERENCED_BY_VERTEX_SHADER);
    in_tessellation += is_in(GL_REFERENCED_BY_TESS_EVALUATION_SHADER);
    in_compute += is_in(GL_REFERENCED_BY_COMPUTE_SHADER);
    // Mesa says of a block that is only touched by atomic operations that no stage refers to it.
    in_fragment += is_in(GL_REFERENCED_BY_VERTEX_SHADER) + is_in(GL_REFERENCED_BY_TESS_EVALUATION_SHADER) +
                               is_in(GL_REFERENCED_BY_COMPUTE_SHADER) ==
                           0
                       ? 1
                       : is_in(GL_REFERENCED_BY_FRAGMENT_SHADER);
  }
  raise(used, DeviceLimit::VertexStorageBlocks, in_vertex);
  raise(used, DeviceLimit::FragmentStorageBlocks, in_fragment);
  raise(used, DeviceLimit::TessellationStorageBlocks, in_tessellation);
  raise(used, DeviceLimit::ComputeStorageBlocks, in_compute);
  const auto uniform_blocks = static_cast<GLuint>(count_of(program, GL_UNIFORM_BLOCK));
  for (GLuint i = 0; i < uniform_blocks; ++i)
    raise(used, DeviceLimit::UniformBlockBytes,
          static_cast<uint64_t>(property_of(program, GL_UNIFORM_BLOCK, i, GL_BUFFER_DATA_SIZE)));
}

void add_textures(uint32_t program, Used& used) {
  uint64_t in_vertex = 0, in_fragment = 0, in_compute = 0, compute_images = 0;
  const auto uniforms = static_cast<GLuint>(count_of(program, GL_UNIFORM));
  for (GLuint i = 0; i < uniforms; ++i) {
    const GLint type = property_of(program, GL_UNIFORM, i, GL_TYPE);
    if (type == GL_IMAGE_2D || type == GL_IMAGE_3D) {
      EXPECT_NE(property_of(program, GL_UNIFORM, i, GL_REFERENCED_BY_COMPUTE_SHADER), 0)
          << "images in other stages need a row in the table";
      ++compute_images;
    }
    if (type != GL_SAMPLER_2D && type != GL_SAMPLER_3D && type != GL_SAMPLER_BUFFER &&
        type != GL_UNSIGNED_INT_SAMPLER_BUFFER)
      continue;
    in_fragment += property_of(program, GL_UNIFORM, i, GL_REFERENCED_BY_FRAGMENT_SHADER) != 0 ? 1u : 0u;
    in_compute += property_of(program, GL_UNIFORM, i, GL_REFERENCED_BY_COMPUTE_SHADER) != 0 ? 1u : 0u;
    in_vertex += property_of(program, GL_UNIFORM, i, GL_REFERENCED_BY_VERTEX_SHADER) != 0 ? 1u : 0u;
    EXPECT_EQ(property_of(program, GL_UNIFORM, i, GL_REFERENCED_BY_TESS_EVALUATION_SHADER), 0)
        << "textures in the tessellation stage need a row in the table";
  }
  raise(used, DeviceLimit::VertexTextureUnits, in_vertex);
  raise(used, DeviceLimit::FragmentTextureUnits, in_fragment);
  raise(used, DeviceLimit::ComputeTextureUnits, in_compute);
  raise(used, DeviceLimit::ComputeImages, compute_images);
}

class LimitsInUse : public GlTest {
 protected:
  /// Links every program with the first and with the last value of all its variants, and in the whole grid
  /// with every other value of one of them among these.
  Used measure() {
    const ShaderLibrary library;
    std::map<std::string, std::vector<std::string>> programs;  // stages of one name belong together
    for (const std::string& stage : library.stage_files())
      programs[std::filesystem::path(stage).replace_extension().string()].push_back(stage);
    Used used;
    for (auto& [name, stages] : programs) {
      if (stages.size() == 1 && stages.front().ends_with(".frag"))
        stages.insert(stages.begin(), vertex_stage_of(library, stages.front()));
      Variant first, last;
      std::map<std::string, std::vector<int>> values;
      for (const std::string& stage : stages) {
        const auto flat = library.flatten(stage);
        if (!flat) {
          ADD_FAILURE() << flat.error().to_string();
          continue;
        }
        for (const VariantAxis& axis : flat->axes) {
          values[axis.name] = axis.values;
          first[axis.name] = axis.values.front();
          last[axis.name] = axis.values.back();
        }
      }
      // What is blended takes the colour of the vertex stage.
      const bool is_blended = stages.front() == "render/strand.vert" && stages.back() != "render/strand.frag";
      if (is_blended) {
        values["IS_PER_FRAGMENT"] = {0};
        first["IS_PER_FRAGMENT"] = last["IS_PER_FRAGMENT"] = 0;
      }
      std::set<Variant> variants{first, last};
      for (const auto& [axis, all] : values)
        for (const int value : test_grid() == TestGrid::Whole ? all : std::vector<int>{})
          for (Variant variant : {first, last}) {
            variant[axis] = value;
            variants.insert(variant);
          }
      for (const Variant& variant : variants) add(library, stages, variant, used);
    }
    return used;
  }

 private:
  /// Of a fragment stage that is linked with the vertex stage of another: told by the inputs that it takes.
  static std::string vertex_stage_of(const ShaderLibrary& library, const std::string& fragment_stage) {
    const auto flat = library.flatten(fragment_stage);
    if (!flat) {
      ADD_FAILURE() << flat.error().to_string();
      return "render/resolve.vert";
    }
    const auto takes = [&](const char* input) { return flat->text.find(input) != std::string::npos; };
    if (takes("v_depth_m")) return "render/shadow_map.vert";
    if (takes("v_cover")) return "render/head.vert";
    return takes("v_width_px") ? "render/strand.vert" : "render/resolve.vert";
  }
  static void add(const ShaderLibrary& library, const std::vector<std::string>& stages,
                  const Variant& variant, Used& used) {
    // Without its outputs captured a program that draws nothing needs none of its inputs.
    const bool is_expand = stages.front().starts_with("render/expand");
    const std::vector<std::string> captured =
        is_expand ? std::vector<std::string>{"expanded_position_m", "expanded_along", "expanded_tangent",
                                             "expanded_strand"}
                  : std::vector<std::string>{};
    const auto program = Program::make(library, stages, variant, captured);
    ASSERT_TRUE(program) << program.error().to_string();
    add_blocks(program->name(), used);
    add_textures(program->name(), used);
    if (!stages.front().ends_with(".comp")) return;
    std::array<GLint, 3> size{};
    glGetProgramiv(program->name(), GL_COMPUTE_WORK_GROUP_SIZE, size.data());
    raise(used, DeviceLimit::GroupSize, static_cast<uint64_t>(*std::max_element(size.begin(), size.end())));
    raise(used, DeviceLimit::GroupInvocations, static_cast<uint64_t>(size[0] * size[1] * size[2]));
  }
};

TEST_F(LimitsInUse, AreThoseOfTheTable) {
  for (const auto& [limit, used] : measure()) {
    const DeviceLimitRow& row = row_of(limit);
    EXPECT_EQ(used, row.needed) << row.name << ", " << row.user;
  }
}

TEST_F(LimitsInUse, AreOfferedByThisDevice) {
  const DeviceLimits given = read_device_limits();
  EXPECT_TRUE(check_device_limits(given)) << check_device_limits(given).error().message;
  for (const DeviceLimitRow& row : device_limit_table())
    EXPECT_GE(given.of(row.limit), row.guaranteed) << row.name << ": OpenGL 4.5 guarantees more";
}

// Drivers do not tell how much shared memory a program takes.
TEST(DeviceLimits, FilesThatShareMemoryAreKnown) {
  // vec3 arrays have a stride of 16 bytes at most.
  constexpr uint64_t kVectors = 128 + 128 + 2 * 128, kFloats = 128;
  constexpr uint64_t kSteps = 128, kInvocations = 16;
  const std::map<std::string, uint64_t> known{{"bins_begin.comp", 128 * 4},
                                              {"cells.comp", 32 * 4},
                                              {"dftl_parallel.comp", kVectors * 16 + kFloats * 4},
                                              {"running_sum.comp", 128 * 4},
                                              {"tile_offsets.comp", 128 * 4},
                                              {"tile_order.comp", (3 + kInvocations + kSteps) * 4}};
  constexpr uint64_t kMaxShaderBytes = 1u << 20;
  const std::filesystem::path folder = std::filesystem::path(STRANDCAST_SOURCE_DIR) / "shaders";
  uint64_t most = 0;
  size_t seen = 0;
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder)) {
    if (!file.is_regular_file() || file.path().extension() == ".md") continue;
    const auto text = load_text(file.path(), kMaxShaderBytes);
    ASSERT_TRUE(text) << text.error().to_string();
    if (text->find("\nshared ") == std::string::npos) continue;
    const auto row = known.find(file.path().filename());
    ASSERT_NE(row, known.end()) << file.path() << " shares memory: add what it takes here";
    most = std::max(most, row->second);
    ++seen;
  }
  EXPECT_EQ(seen, known.size());
  EXPECT_EQ(most, row_of(DeviceLimit::SharedBytes).needed);
}

// What every device of OpenGL 4.5 has is not worth a row there.
TEST(DeviceLimits, BeyondWhatOpenGlGuaranteesAreListedInTheReadme) {
  constexpr uint64_t kMaxReadmeBytes = 1u << 20;
  const auto readme =
      load_text(std::filesystem::path(STRANDCAST_SOURCE_DIR) / "shaders/README.md", kMaxReadmeBytes);
  ASSERT_TRUE(readme) << readme.error().to_string();
  for (const DeviceLimitRow& row : device_limit_table()) {
    const std::string begin = fmt::format("\n| {} | {} | ", row.name, row.guaranteed);
    const std::string line = fmt::format("{}{}, `{}` |", begin, row.needed, row.user);
    if (row.needed > row.guaranteed)
      EXPECT_THAT(*readme, HasSubstr(line));
    else
      EXPECT_THAT(*readme, testing::Not(HasSubstr(begin))) << "a device has that anyway";
  }
}

}  // namespace
}  // namespace strandcast::gl::device_limits_test
