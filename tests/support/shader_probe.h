// Fixture that runs functions of the shaders on the GPU, one invocation per row of inputs.
#pragma once

#include <epoxy/gl.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "tests/support/gl_fixture.h"
#include "tests/support/temporary_folder.h"

namespace strandcast {

class ShaderProbe : public GlTest {
 protected:
  using Rows = std::vector<std::vector<glm::vec4>>;
  using Prepare = std::function<void(const gl::Program&)>;

  /// Evaluates `body`, which returns a vec4 from `a(0u)`, `a(1u)`, ... of one invocation, for every row.
  /// `includes`: by their paths below shaders/; `prepare`: sets uniforms and textures.
  std::vector<glm::vec4> evaluate(const std::vector<std::string>& includes, const std::string& body,
                                  const Rows& rows, const Prepare& prepare = {}) {
    constexpr size_t kGroup = 32;
    const auto shaders = std::filesystem::path(STRANDCAST_SOURCE_DIR) / "shaders";
    for (const char* part : {"lib", "render", "shared"})
      std::filesystem::copy(
          shaders / part, folder_.path() / part,
          std::filesystem::copy_options::recursive | std::filesystem::copy_options::overwrite_existing);
    std::string text;
    for (const std::string& include : includes) text += "#include \"" + include + "\"\n";
    folder_.write("probe.comp",
                  text +
                      "layout(local_size_x = 32) in;\n"
                      "layout(std430, binding = 0) readonly buffer In { vec4 v[]; } inputs;\n"
                      "layout(std430, binding = 1) buffer Out { vec4 v[]; } outputs;\n"
                      "uniform uint u_columns;\n"
                      "vec4 a(uint i) { return inputs.v[gl_GlobalInvocationID.x * u_columns + i]; }\n"
                      "vec4 probe() {\n" +
                      body +
                      "}\n"
                      "void main() { outputs.v[gl_GlobalInvocationID.x] = probe(); }\n");
    auto program = gl::Program::make(gl::ShaderLibrary(folder_.path()), {"probe.comp"}, {});
    if (!program) {
      ADD_FAILURE() << program.error().to_string();
      return std::vector<glm::vec4>(rows.size());
    }
    std::vector<glm::vec4> flat;
    const size_t padded = (rows.size() + kGroup - 1) / kGroup * kGroup;
    for (size_t row = 0; row < padded; ++row)
      for (const glm::vec4& value : rows[std::min(row, rows.size() - 1)]) flat.push_back(value);
    const gl::Buffer inputs = gl::Buffer::of("in", flat);
    const gl::Buffer outputs("out", padded * sizeof(glm::vec4));
    program->use();
    program->set("u_columns", static_cast<uint32_t>(rows.front().size()));
    if (prepare) prepare(*program);
    inputs.bind_storage(0);
    outputs.bind_storage(1);
    glDispatchCompute(static_cast<GLuint>(padded / kGroup), 1, 1);
    auto result = outputs.read_all<glm::vec4>();
    result.resize(rows.size());
    return result;
  }

  TemporaryFolder folder_;
};

}  // namespace strandcast
