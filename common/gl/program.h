// Linked GL programs from embedded shader sources: #include flattened by the host with a line table (Mesa
// loses #line file ids), variants declared in the source by "#pragma variant NAME v0 v1 ...". Files carry no
// #version: the host puts "#version 450 core" and the variants' #defines in front. ShaderLibrary is pure text
// work for any thread; programs need a current context.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/gl/objects.h"

namespace strandcast::gl {

/// Values of declared variants, for example {{"HAS_WIND", 1}}. Undeclared names and values are errors.
using Variant = std::map<std::string, int>;

struct VariantAxis {
  std::string name;
  std::vector<int> values;  // the first is the default
};

/// One shader file after flattening, with the way back from a line of it to file:line.
struct FlatSource {
  std::string text;
  std::vector<std::pair<uint16_t, uint32_t>> line_origin;  // (line count) file index and line
  std::vector<std::string> files;
  std::vector<VariantAxis> axes;
};

/// Reads shader files by their path below shaders/ from the binary, or from a folder when one is given.
class ShaderLibrary {
 public:
  ShaderLibrary() = default;
  explicit ShaderLibrary(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Each file enters once, where it is first included; <angle bracket> includes (for C++) are dropped.
  /// NotFound names the file and who includes it; include cycles and differing declarations of a variant are
  /// BadInput.
  Result<FlatSource> flatten(const std::string& path) const;
  /// Every file that is a shader stage (.vert .tesc .tese .geom .frag .comp), sorted.
  std::vector<std::string> stage_files() const;

 private:
  Result<std::string> load(const std::string& path) const;
  std::optional<std::filesystem::path> folder_;
};

/// Uniforms outside of blocks that the source declares in any of its variants, by name with their GLSL type.
std::map<std::string, std::string> declared_uniforms(const FlatSource& source);

/// All combinations of the axes' values; one empty variant when there are no axes.
std::vector<Variant> all_variants(const std::vector<VariantAxis>& axes);
/// All of them while they are few, else some in which every two values of every two axes meet: what checks of
/// all shaders walk.
std::vector<Variant> covering_variants(const std::vector<VariantAxis>& axes);

/// What stands in front of the flattened text: the version, and a #define for each axis, with its default
/// where the variant names no value.
std::string variant_header(const FlatSource& source, const Variant& variant);
/// The same values for people: "HAS_WIND=1 HAS_HEAD=0".
std::string describe_variant(const FlatSource& source, const Variant& variant);

/// Puts file:line of the original sources where a compiler log names lines of the flattened text, of which
/// `header_lines` were put in front. Knows the forms of Mesa "0:LINE(COLUMN)", NVIDIA "0(LINE)" and others
/// "0:LINE".
std::string map_compiler_log(const FlatSource& source, uint32_t header_lines, const std::string& log);

/// Compiles one stage file alone, without linking. For checks that walk stage_files() and all_variants().
Status compile_stage(const ShaderLibrary& library, const std::string& stage_path, const Variant& variant);

class Program {
 public:
  Program() = default;
  /// Stages by file extension. A variant's name must be declared by at least one stage; each stage gets
  /// #defines for its own axes, missing ones with their default. `captured`: varyings for transform feedback,
  /// interleaved. Errors carry the compiler's message with file:line of the original source.
  static Result<Program> make(const ShaderLibrary& library, const std::vector<std::string>& stage_paths,
                              const Variant& variant, const std::vector<std::string>& captured = {});
  void use() const;
  uint32_t name() const { return handle_.name(); }

  /// BadInput unless a stage declares a uniform of that name and GLSL type ("float") in any of its variants.
  Status check_uniform(std::string_view name, std::string_view type) const;

  // Uniforms by name. One that is declared but not used by this variant is ignored; a name or type that no
  // stage declares stops the process with a sentence. Do not change which program is in use.
  void set(std::string_view name, int value) const;
  void set(std::string_view name, uint32_t value) const;
  void set(std::string_view name, float value) const;
  void set(std::string_view name, const glm::vec2& value) const;
  void set(std::string_view name, const glm::vec3& value) const;
  void set(std::string_view name, const glm::mat4& value) const;

 private:
  struct Uniform {
    std::string type;   // as declared
    int location = -1;  // -1 = not used by this variant
  };
  int location(std::string_view name, std::string_view type) const;
  Handle<delete_program> handle_;
  std::string label_;
  std::map<std::string, Uniform, std::less<>> uniforms_;
};

}  // namespace strandcast::gl
