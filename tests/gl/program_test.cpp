#include "common/gl/program.h"

#include <epoxy/gl.h>

#include "common/base/hash.h"
#include "common/groom/groom.h"
#include "common/scene/scene_desc.h"
#include "server/sim/solver.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"
#include "tests/support/gl_fixture.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::gl::program_test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

// What shaders repeat from C++ because those headers hold more than constants.
static_assert(shader::kMaxVertexCount == kMaxVertexCount);
static_assert(shader::kMaxSphereColliders == kMaxSphereColliders);
static_assert(shader::kMaxGustWaves == kMaxGustWaves);
static_assert(shader::kBindingPosition == 0);

class Programs : public GlTest {
 protected:
  ShaderLibrary library() const { return ShaderLibrary(folder_.path()); }
  std::string error_of(const std::vector<std::string>& stages, const Variant& variant = {}) const {
    const auto program = Program::make(library(), stages, variant);
    return program ? "" : program.error().to_string();
  }

  TemporaryFolder folder_;
};

/// Runs a kernel whose storage block 0 is an array of uint and returns the array.
std::vector<uint32_t> run_kernel(const Program& program, size_t count) {
  const Buffer result("result", count * sizeof(uint32_t));
  program.use();
  result.bind_storage(0);
  glDispatchCompute(static_cast<GLuint>((count + 63) / 64), 1, 1);
  return result.read_all<uint32_t>();
}

constexpr const char* kWriteValue =
    "layout(local_size_x = 64) in;\n"
    "layout(std430, binding = 0) buffer Result { uint value[]; } result;\n"
    "void main() {\n"
    "  if (gl_GlobalInvocationID.x < uint(result.value.length())) result.value[gl_GlobalInvocationID.x] = "
    "VALUE;\n"
    "}\n";

TEST_F(Programs, ErrorsNameTheFileAndLineThroughIncludes) {
  folder_.write("lib/good.glsl", "float one() { return 1.0; }\n");
  folder_.write("lib/bad.glsl", "#include \"lib/good.glsl\"\nfloat two() {\n  return no_such_name;\n}\n");
  folder_.write("a.comp",
                "#include \"lib/good.glsl\"\n#include \"lib/bad.glsl\"\nlayout(local_size_x = 1) in;\nvoid "
                "main() {}\n");
  EXPECT_THAT(error_of({"a.comp"}), AllOf(HasSubstr("a.comp: does not compile"), HasSubstr("lib/bad.glsl:3"),
                                          HasSubstr("no_such_name")));
  folder_.write("b.comp",
                "#include \"lib/good.glsl\"\nlayout(local_size_x = 1) in;\nvoid main() { nonsense; }\n");
  EXPECT_THAT(error_of({"b.comp"}), HasSubstr("b.comp:3"));
}

TEST_F(Programs, MapsTheLogFormsOfAllVendors) {
  FlatSource source;
  source.files = {"a.comp", "lib/b.glsl"};
  source.line_origin = {{0, 1}, {1, 1}, {1, 2}, {0, 3}};
  EXPECT_EQ(map_compiler_log(source, 2, "0:5(3): error: x"), "lib/b.glsl:2: error: x");
  EXPECT_EQ(map_compiler_log(source, 2, "0(6) : error C1008: x\n0(4) : y"),
            "a.comp:3 : error C1008: x\nlib/b.glsl:1 : y");
  EXPECT_EQ(map_compiler_log(source, 2, "ERROR: 0:3: x"), "ERROR: a.comp:1: x");
  EXPECT_EQ(map_compiler_log(source, 2, "0:2(1): in the header, 0:99(1): nowhere, 10:4"),
            "0:2(1): in the header, 0:99(1): nowhere, 10:4");
}

TEST_F(Programs, EveryFileEntersOnceAndAngleBracketsAreForCpp) {
  folder_.write("lib/a.glsl", "// a\n");
  folder_.write("lib/b.glsl", "#include \"lib/a.glsl\"\n// b");
  folder_.write("c.comp", "#include <cstdint>\n#include \"lib/a.glsl\"\n  #  include \"lib/b.glsl\"\n// c\n");
  const auto flat = library().flatten("c.comp");
  ASSERT_TRUE(flat) << flat.error().to_string();
  EXPECT_THAT(flat->files, ElementsAre("c.comp", "lib/a.glsl", "lib/b.glsl"));
  EXPECT_EQ(flat->line_origin.size(),
            static_cast<size_t>(std::count(flat->text.begin(), flat->text.end(), '\n')));
  EXPECT_EQ(flat->text.find("// a"), flat->text.rfind("// a"));
  EXPECT_THAT(flat->text, Not(HasSubstr("include")));
}

TEST_F(Programs, RefusesCyclesMissingFilesAndPathsOutside) {
  folder_.write("lib/a.glsl", "\n#include \"lib/b.glsl\"\n");
  folder_.write("lib/b.glsl", "#include \"lib/a.glsl\"\n");
  folder_.write("cycle.comp", "#include \"lib/a.glsl\"\n");
  EXPECT_EQ(error_of({"cycle.comp"}),
            "lib/b.glsl:1: include cycle: cycle.comp -> lib/a.glsl -> lib/b.glsl -> lib/a.glsl");
  folder_.write("missing.comp", "\n#include \"lib/none.glsl\"\n");
  EXPECT_EQ(error_of({"missing.comp"}), "lib/none.glsl: no such shader file, included from missing.comp:2");
  EXPECT_EQ(library().flatten("none.comp").error().code, ErrorCode::NotFound);
  folder_.write("outside.comp", "#include \"../x.glsl\"\n");
  EXPECT_THAT(error_of({"outside.comp"}), HasSubstr("stay below"));
  folder_.write("version.comp", "#version 460\n");
  EXPECT_THAT(error_of({"version.comp"}), HasSubstr("version.comp:1"));
  folder_.write("stage.glsl", "");
  EXPECT_THAT(error_of({"stage.glsl"}), HasSubstr("known: .vert"));
}

TEST_F(Programs, VariantsReachTheCodeAndDefaultToTheFirstValue) {
  folder_.write("lib/axis.glsl", "#pragma variant VALUE 3 5 -7 // three of them\n");
  folder_.write(
      "v.comp",
      std::string("#include \"lib/axis.glsl\"\n#define VALUE_ VALUE\n") +
          std::string(kWriteValue).replace(std::string(kWriteValue).find("VALUE"), 5, "uint(VALUE)"));
  for (const auto& [variant, expected] : std::vector<std::pair<Variant, uint32_t>>{
           {{}, 3u}, {{{"VALUE", 5}}, 5u}, {{{"VALUE", -7}}, uint32_t(-7)}}) {
    const auto program = Program::make(library(), {"v.comp"}, variant);
    ASSERT_TRUE(program) << program.error().to_string();
    EXPECT_THAT(run_kernel(*program, 3), ElementsAre(expected, expected, expected));
  }
}

TEST_F(Programs, UndeclaredVariantsAreErrorsThatNameTheKnownOnes) {
  folder_.write("a.vert", "#pragma variant A 0 1\nvoid main() { gl_Position = vec4(float(A)); }\n");
  folder_.write("a.frag", "#pragma variant B 0 1\nout vec4 c;\nvoid main() { c = vec4(float(B)); }\n");
  EXPECT_EQ(error_of({"a.vert", "a.frag"}, {{"A", 1}, {"B", 1}}), "") << "each stage declares one of them";
  EXPECT_THAT(error_of({"a.vert", "a.frag"}, {{"C", 1}}), HasSubstr("undeclared variant C (known: A, B)"));
  EXPECT_THAT(error_of({"a.vert", "a.frag"}, {{"B", 2}}),
              HasSubstr("undeclared value 2 of variant B (known: 0, 1)"));
  EXPECT_THAT(error_of({"a.vert"}, {{"B", 1}}), HasSubstr("undeclared variant B"));
  folder_.write("other.frag", "#pragma variant A 0 1 2\nout vec4 c;\nvoid main() { c = vec4(float(A)); }\n");
  EXPECT_THAT(error_of({"a.vert", "other.frag"}), HasSubstr("values 0 1 2 here and 0 1"));
  for (const char* line : {"#pragma variant A", "#pragma variant A x", "#pragma variant A 1 1"}) {
    folder_.write("bad.vert", std::string(line) + "\nvoid main() {}\n");
    EXPECT_THAT(error_of({"bad.vert"}), HasSubstr("bad.vert:1")) << line;
  }
}

TEST_F(Programs, AllVariantsIsTheFullProduct) {
  const auto variants = all_variants({{"A", {0, 1}}, {"B", {2, 4, 8}}});
  EXPECT_EQ(variants.size(), 6u);
  EXPECT_EQ(std::set<Variant>(variants.begin(), variants.end()).size(), 6u);
  EXPECT_EQ(all_variants({}).size(), 1u);
}

TEST(Variants, EveryTwoValuesOfEveryTwoAxesMeetInThoseThatCover) {
  const std::vector<VariantAxis> axes{
      {"A", {0, 1, 2, 3, 4}}, {"B", {0, 1, 2}}, {"C", {0, 1}}, {"D", {0, 1, 2}}};
  const auto chosen = covering_variants(axes);
  EXPECT_LT(chosen.size(), 25u) << "of 90";
  for (size_t i = 0; i < axes.size(); ++i)
    for (size_t j = i + 1; j < axes.size(); ++j)
      for (const int a : axes[i].values)
        for (const int b : axes[j].values)
          EXPECT_TRUE(std::any_of(chosen.begin(), chosen.end(),
                                  [&](const Variant& variant) {
                                    return variant.at(axes[i].name) == a && variant.at(axes[j].name) == b;
                                  }))
              << axes[i].name << a << axes[j].name << b;
  EXPECT_EQ(covering_variants({{"A", {0, 1}}, {"B", {0, 1}}}).size(), 4u);
  EXPECT_EQ(covering_variants({}).size(), 1u);
}

TEST_F(Programs, LinkErrorsNameTheStages) {
  folder_.write("a.vert", "out vec3 colour;\nvoid main() { colour = vec3(1.0); gl_Position = vec4(0.0); }\n");
  folder_.write("a.frag", "in vec4 colour;\nout vec4 c;\nvoid main() { c = colour; }\n");
  EXPECT_THAT(error_of({"a.vert", "a.frag"}), HasSubstr("a.vert + a.frag: does not link"));
}

constexpr const char* kUniforms =
    "#pragma variant HAS_SCALE 0 1\n"
    "uniform uint u_value;\nuniform vec3 u_more;  // not: uniform float u_comment;\n"
    "layout(binding = 3) uniform samplerBuffer u_table;\n"
    "#if HAS_SCALE\nuniform float u_scale;\n#endif\n"
    "#define VALUE (u_value + uint(u_more.y))\n";

TEST_F(Programs, UniformsAreSetByNameAndThoseThatAVariantDoesNotUseAreIgnored) {
  folder_.write("u.comp", std::string(kUniforms) + kWriteValue);
  const auto program = Program::make(library(), {"u.comp"}, {});
  ASSERT_TRUE(program) << program.error().to_string();
  program->set("u_value", 40u);
  program->set("u_more", glm::vec3(9.0f, 2.0f, 9.0f));
  program->set("u_scale", 1.0f);  // of the other variant
  program->set("u_table", 3);     // optimised away
  EXPECT_THAT(run_kernel(*program, 1), ElementsAre(42u));
  EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
}

TEST_F(Programs, UniformsThatNoVariantDeclaresAreErrorsWithTheirName) {
  folder_.write("u.comp", std::string(kUniforms) + kWriteValue);
  const auto program = Program::make(library(), {"u.comp"}, {});
  ASSERT_TRUE(program) << program.error().to_string();
  EXPECT_TRUE(program->check_uniform("u_scale", "float"));
  EXPECT_TRUE(program->check_uniform("u_table", "int"));
  for (const char* name : {"u_valve", "u_comment", "value", ""}) {
    const Status unknown = program->check_uniform(name, "uint");
    ASSERT_FALSE(unknown) << name;
    EXPECT_EQ(
        unknown.error().to_string(),
        fmt::format("u.comp: no variant declares a uniform {} (known: u_more, u_scale, u_table, u_value)",
                    name));
  }
  const Status other_type = program->check_uniform("u_value", "float");
  ASSERT_FALSE(other_type);
  EXPECT_EQ(other_type.error().to_string(), "u.comp: uniform u_value is declared as uint, not as float");
}

TEST_F(Programs, SettingAnUnknownUniformStopsTheProcessWithItsName) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // the driver has threads
  folder_.write("u.comp", std::string(kUniforms) + kWriteValue);
  const auto set = [this](auto value) {
    const auto program = Program::make(library(), {"u.comp"}, {});
    if (program) program->set("u_valve", value);
  };
  EXPECT_DEATH(set(1u), "u.comp: no variant declares a uniform u_valve");
  EXPECT_DEATH(set(1.0f), "u.comp: no variant declares a uniform u_valve");
}

TEST_F(Programs, TheDeclaredUniformsOfOurShadersHoldThoseThatTheDriverKnows) {
  const ShaderLibrary embedded;
  for (const std::string& stage : embedded.stage_files()) {
    if (!stage.ends_with(".comp")) continue;
    const auto flat = embedded.flatten(stage);
    ASSERT_TRUE(flat) << stage;
    const auto declared = declared_uniforms(*flat);
    const auto program = Program::make(embedded, {stage}, {});
    ASSERT_TRUE(program) << program.error().to_string();
    GLint count = 0;
    glGetProgramiv(program->name(), GL_ACTIVE_UNIFORMS, &count);
    for (GLint i = 0; i < count; ++i) {
      char name[256] = {};
      GLint size = 0;
      GLenum type = 0;
      glGetActiveUniform(program->name(), static_cast<GLuint>(i), sizeof(name), nullptr, &size, &type, name);
      if (glGetUniformLocation(program->name(), name) < 0) continue;  // of a block
      EXPECT_TRUE(declared.contains(name)) << stage << ": " << name;
    }
  }
}

TEST_F(Programs, TheShaderHashIsTheHashOfTheHost) {
  folder_.write("lib/hash.glsl", [] {
    const auto flat = ShaderLibrary().flatten("lib/hash.glsl");
    return flat ? flat->text : "";
  }());
  const std::string kernel = kWriteValue;
  folder_.write(
      "mix.comp",
      "#include \"lib/hash.glsl\"\n#define VALUE mix_u32(gl_GlobalInvocationID.x * 2654435761u)\n" + kernel);
  folder_.write("unit.comp",
                "#include \"lib/hash.glsl\"\n"
                "#define VALUE floatBitsToUint(unit_float(mix_u32(gl_GlobalInvocationID.x)))\n" +
                    kernel);
  const auto mix = Program::make(library(), {"mix.comp"}, {});
  const auto unit = Program::make(library(), {"unit.comp"}, {});
  ASSERT_TRUE(mix && unit);
  constexpr uint32_t kCount = 20'000;
  const auto mixed = run_kernel(*mix, kCount);
  const auto units = run_kernel(*unit, kCount);
  for (uint32_t i = 0; i < kCount; ++i) {
    ASSERT_EQ(mixed[i], mix_u32(i * 2654435761u)) << i;
    ASSERT_EQ(std::bit_cast<float>(units[i]), unit_float(mix_u32(i))) << i;
  }
}

TEST_F(Programs, SharedConstantsWorkInLayouts) {
  const ShaderLibrary embedded;
  for (const char* path : {"shared/limits.h", "shared/bindings.h"}) {
    const auto flat = embedded.flatten(path);
    ASSERT_TRUE(flat) << flat.error().to_string();
    folder_.write(path, flat->text);
  }
  folder_.write("s.comp",
                "#include \"shared/limits.h\"\n#include \"shared/bindings.h\"\n"
                "layout(local_size_x = kStrandLocalSize) in;\n"
                "layout(std430, binding = kBindingPosition) buffer Result { uint value[]; } result;\n"
                "shared uint lanes[kStrandLocalSize];\n"
                "void main() { lanes[gl_LocalInvocationIndex] = 1u; barrier();\n"
                "  if (gl_GlobalInvocationID.x == 0u) result.value[0] = gl_WorkGroupSize.x; }\n");
  const auto program = Program::make(library(), {"s.comp"}, {});
  ASSERT_TRUE(program) << program.error().to_string();
  EXPECT_THAT(run_kernel(*program, 1), ElementsAre(shader::kStrandLocalSize));
}

}  // namespace
}  // namespace strandcast::gl::program_test
