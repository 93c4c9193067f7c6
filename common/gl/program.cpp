#include "common/gl/program.h"

#include <epoxy/gl.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "common/base/check.h"

namespace strandcast::gl {
namespace {

/// A compiled stage, deleted with the last program it is attached to.
class Shader {
 public:
  explicit Shader(uint32_t name) : name_(name) {}
  Shader(Shader&& other) noexcept : name_(std::exchange(other.name_, 0u)) {}
  Shader& operator=(Shader&&) = delete;
  ~Shader() {
    if (name_ != 0) glDeleteShader(name_);
  }
  uint32_t name() const { return name_; }

 private:
  uint32_t name_;
};

struct StageSource {
  std::string path;
  GLenum kind = 0;
  FlatSource flat;
};

Result<GLenum> stage_kind(const std::string& path) {
  static const std::map<std::string, GLenum, std::less<>> kKinds = {
      {".vert", GL_VERTEX_SHADER},   {".tesc", GL_TESS_CONTROL_SHADER}, {".tese", GL_TESS_EVALUATION_SHADER},
      {".geom", GL_GEOMETRY_SHADER}, {".frag", GL_FRAGMENT_SHADER},     {".comp", GL_COMPUTE_SHADER}};
  const auto found = kKinds.find(std::filesystem::path(path).extension().string());
  if (found == kKinds.end())
    return at(path, make_error(ErrorCode::BadInput,
                               "no shader stage (known: .vert, .tesc, .tese, .geom, .frag, .comp)"));
  return found->second;
}

Result<std::vector<StageSource>> load_stages(const ShaderLibrary& library,
                                             const std::vector<std::string>& paths) {
  std::vector<StageSource> stages;
  for (const std::string& path : paths) {
    ASSIGN_OR_RETURN(const GLenum kind, stage_kind(path));
    ASSIGN_OR_RETURN(FlatSource flat, library.flatten(path));
    stages.push_back({path, kind, std::move(flat)});
  }
  return stages;
}

/// Axes of all stages together; the same name means the same values.
Result<std::vector<VariantAxis>> merge_axes(const std::vector<StageSource>& stages) {
  std::vector<VariantAxis> merged;
  for (const StageSource& stage : stages) {
    for (const VariantAxis& axis : stage.flat.axes) {
      const auto known = std::find_if(merged.begin(), merged.end(),
                                      [&](const VariantAxis& other) { return other.name == axis.name; });
      if (known == merged.end())
        merged.push_back(axis);
      else if (known->values != axis.values)
        return at(stage.path,
                  make_error(ErrorCode::BadInput, "variant {} has values {} here and {} in another stage",
                             axis.name, fmt::join(axis.values, " "), fmt::join(known->values, " ")));
    }
  }
  return merged;
}

Status check_variant(const std::vector<StageSource>& stages, const Variant& variant) {
  ASSIGN_OR_RETURN(const auto axes, merge_axes(stages));
  const std::string program = stages.empty() ? "" : stages.front().path;
  for (const auto& [name, value] : variant) {
    const auto axis =
        std::find_if(axes.begin(), axes.end(), [&](const auto& other) { return other.name == name; });
    if (axis == axes.end()) {
      std::vector<std::string> known;
      for (const VariantAxis& other : axes) known.push_back(other.name);
      return at(program, make_error(ErrorCode::BadInput, "undeclared variant {} (known: {})", name,
                                    known.empty() ? "none" : fmt::format("{}", fmt::join(known, ", "))));
    }
    if (std::find(axis->values.begin(), axis->values.end(), value) == axis->values.end())
      return at(program, make_error(ErrorCode::BadInput, "undeclared value {} of variant {} (known: {})",
                                    value, name, fmt::join(axis->values, ", ")));
  }
  return {};
}

template <class Length, class Read>
std::string read_log(Length length, Read read) {
  GLint size = 0;
  length(&size);
  std::string log(static_cast<size_t>(std::max(size, 1)), '\0');
  GLsizei written = 0;
  read(static_cast<GLsizei>(log.size()), &written, log.data());
  log.resize(static_cast<size_t>(std::max(written, 0)));
  while (!log.empty() && (log.back() == '\n' || log.back() == ' ')) log.pop_back();
  return log;
}

Result<Shader> compile(const StageSource& stage, const Variant& variant) {
  const std::string header = variant_header(stage.flat, variant);
  Shader shader(glCreateShader(stage.kind));
  const char* parts[] = {header.data(), stage.flat.text.data()};
  const GLint sizes[] = {static_cast<GLint>(header.size()), static_cast<GLint>(stage.flat.text.size())};
  glShaderSource(shader.name(), 2, parts, sizes);
  glCompileShader(shader.name());
  GLint is_compiled = GL_FALSE;
  glGetShaderiv(shader.name(), GL_COMPILE_STATUS, &is_compiled);
  if (is_compiled == GL_TRUE) return shader;
  const std::string log =
      read_log([&](GLint* size) { glGetShaderiv(shader.name(), GL_INFO_LOG_LENGTH, size); },
               [&](GLsizei size, GLsizei* written, char* text) {
                 glGetShaderInfoLog(shader.name(), size, written, text);
               });
  const auto header_lines = static_cast<uint32_t>(std::count(header.begin(), header.end(), '\n'));
  const std::string chosen = describe_variant(stage.flat, variant);
  return at(stage.path, make_error(ErrorCode::BadInput, "does not compile{}: {}",
                                   chosen.empty() ? "" : fmt::format(" with {}", chosen),
                                   map_compiler_log(stage.flat, header_lines, log)));
}

Status link(uint32_t program, const std::vector<Shader>& shaders, const std::vector<std::string>& captured) {
  for (const Shader& shader : shaders) glAttachShader(program, shader.name());
  if (!captured.empty()) {
    std::vector<const char*> names;
    for (const std::string& name : captured) names.push_back(name.c_str());
    glTransformFeedbackVaryings(program, static_cast<GLsizei>(names.size()), names.data(),
                                GL_INTERLEAVED_ATTRIBS);
  }
  glLinkProgram(program);
  for (const Shader& shader : shaders) glDetachShader(program, shader.name());
  GLint is_linked = GL_FALSE;
  glGetProgramiv(program, GL_LINK_STATUS, &is_linked);
  if (is_linked == GL_TRUE) return {};
  return make_error(ErrorCode::BadInput, "does not link: {}",
                    read_log([&](GLint* size) { glGetProgramiv(program, GL_INFO_LOG_LENGTH, size); },
                             [&](GLsizei size, GLsizei* written, char* text) {
                               glGetProgramInfoLog(program, size, written, text);
                             }));
}

/// Whether a value of the C++ side's type may be given to a uniform: samplers take the number of their unit.
bool is_settable(std::string_view declared, std::string_view given) {
  const bool is_sampler = declared.find("sampler") != std::string_view::npos;
  return declared == given || (is_sampler && given == "int");
}

}  // namespace

Status compile_stage(const ShaderLibrary& library, const std::string& stage_path, const Variant& variant) {
  ASSIGN_OR_RETURN(const auto stages, load_stages(library, {stage_path}));
  RETURN_IF_ERROR(check_variant(stages, variant));
  RETURN_IF_ERROR(compile(stages.front(), variant));
  return {};
}

Result<Program> Program::make(const ShaderLibrary& library, const std::vector<std::string>& stage_paths,
                              const Variant& variant, const std::vector<std::string>& captured) {
  ASSIGN_OR_RETURN(const auto stages, load_stages(library, stage_paths));
  RETURN_IF_ERROR(check_variant(stages, variant));
  std::vector<Shader> shaders;
  for (const StageSource& stage : stages) {
    ASSIGN_OR_RETURN(Shader shader, compile(stage, variant));
    shaders.push_back(std::move(shader));
  }
  const std::string label = fmt::format("{}", fmt::join(stage_paths, " + "));
  Program program;
  program.handle_ = Handle<delete_program>(glCreateProgram());
  if (auto linked = link(program.name(), shaders, captured); !linked) return at(label, linked.error());
  count_compiled_program();
  GLint longest_label = 0;
  glGetIntegerv(GL_MAX_LABEL_LENGTH, &longest_label);
  const size_t label_size = std::min(label.size(), static_cast<size_t>(std::max(longest_label, 1) - 1));
  glObjectLabel(GL_PROGRAM, program.name(), static_cast<GLsizei>(label_size), label.data());
  program.label_ = label;
  for (const StageSource& stage : stages)
    for (const auto& [uniform, type] : declared_uniforms(stage.flat))
      program.uniforms_[uniform] = {type, glGetUniformLocation(program.name(), uniform.c_str())};
  return program;
}

void Program::use() const {
  glUseProgram(name());
}

Status Program::check_uniform(std::string_view uniform, std::string_view type) const {
  const auto found = uniforms_.find(uniform);
  if (found == uniforms_.end()) {
    std::vector<std::string> known;
    for (const auto& [name, declared] : uniforms_) known.push_back(name);
    return at(label_, make_error(ErrorCode::BadInput, "no variant declares a uniform {} (known: {})", uniform,
                                 known.empty() ? "none" : fmt::format("{}", fmt::join(known, ", "))));
  }
  if (is_settable(found->second.type, type)) return {};
  return at(label_, make_error(ErrorCode::BadInput, "uniform {} is declared as {}, not as {}", uniform,
                               found->second.type, type));
}

int Program::location(std::string_view uniform, std::string_view type) const {
  const auto found = uniforms_.find(uniform);
  if (found != uniforms_.end() && is_settable(found->second.type, type)) return found->second.location;
  const std::string sentence = check_uniform(uniform, type).error().to_string();
  check_failed(sentence.c_str(), __FILE__, __LINE__);
}

void Program::set(std::string_view uniform, int value) const {
  glProgramUniform1i(name(), location(uniform, "int"), value);
}
void Program::set(std::string_view uniform, uint32_t value) const {
  glProgramUniform1ui(name(), location(uniform, "uint"), value);
}
void Program::set(std::string_view uniform, float value) const {
  glProgramUniform1f(name(), location(uniform, "float"), value);
}
void Program::set(std::string_view uniform, const glm::vec2& value) const {
  glProgramUniform2fv(name(), location(uniform, "vec2"), 1, &value[0]);
}
void Program::set(std::string_view uniform, const glm::vec3& value) const {
  glProgramUniform3fv(name(), location(uniform, "vec3"), 1, &value[0]);
}
void Program::set(std::string_view uniform, const glm::mat4& value) const {
  glProgramUniformMatrix4fv(name(), location(uniform, "mat4"), 1, GL_FALSE, &value[0][0]);
}

}  // namespace strandcast::gl
