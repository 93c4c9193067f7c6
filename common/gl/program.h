// Linked GL programs from embedded shader sources. The host flattens #include with a line table, because Mesa
// loses #line file ids. Sources declare variants by "#pragma variant NAME v0 v1 ..." and contain no #version.
// The host prepends "#version 450 core" and the variants' #defines. ShaderLibrary only processes text, on any
// thread; programs need a current context.
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

/// A shader file after flattening, with a table from its lines to file:line of the sources.
struct FlatSource {
  std::string text;
  std::vector<std::pair<uint16_t, uint32_t>> line_origin;  // (line count) file index and line
  std::vector<std::string> files;
  std::vector<VariantAxis> axes;
};

/// Reads shader files by their path below shaders/, from the binary or from a folder if one is given.
class ShaderLibrary {
 public:
  ShaderLibrary() = default;
  explicit ShaderLibrary(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Flattens a file and its includes. Each file is inserted once, where it is first included; <angle
  /// bracket> includes (for C++) are dropped. NotFound names the file and its includer. BadInput for include
  /// cycles and for conflicting declarations of a variant.
  Result<FlatSource> flatten(const std::string& path) const;
  /// Returns all files that are shader stages (.vert .tesc .tese .geom .frag .comp), sorted.
  std::vector<std::string> stage_files() const;

 private:
  Result<std::string> load(const std::string& path) const;
  std::optional<std::filesystem::path> folder_;
};

/// Returns the uniforms outside of blocks that the source declares in any variant: name to GLSL type.
std::map<std::string, std::string> declared_uniforms(const FlatSource& source);

/// Returns all combinations of the axes' values; one empty variant if there are no axes.
std::vector<Variant> all_variants(const std::vector<VariantAxis>& axes);
/// Returns all combinations if they are few. Otherwise a selection in which every pair of values of any two
/// axes occurs. Checks of all shaders use it.
std::vector<Variant> covering_variants(const std::vector<VariantAxis>& axes);

/// Returns the lines in front of the flattened text: the version and a #define for each axis, with its
/// default if the variant names no value.
std::string variant_header(const FlatSource& source, const Variant& variant);
/// Returns the same values for people: "HAS_WIND=1 HAS_HEAD=0".
std::string describe_variant(const FlatSource& source, const Variant& variant);

/// Replaces the line numbers of a compiler log by file:line of the original sources. The log counts lines of
/// the flattened text after `header_lines` lines. Knows the forms of Mesa "0:LINE(COLUMN)", NVIDIA "0(LINE)"
/// and others "0:LINE".
std::string map_compiler_log(const FlatSource& source, uint32_t header_lines, const std::string& log);

/// Compiles one stage file without linking, for checks that walk stage_files() and all_variants().
Status compile_stage(const ShaderLibrary& library, const std::string& stage_path, const Variant& variant);

class Program {
 public:
  Program() = default;
  /// Makes a program; file extensions determine the stages. At least one stage must declare each name of the
  /// variant; every stage gets #defines for its own axes, with defaults for missing ones. `captured`:
  /// varyings for transform feedback, interleaved. Errors carry the compiler's message with file:line of the
  /// original source.
  static Result<Program> make(const ShaderLibrary& library, const std::vector<std::string>& stage_paths,
                              const Variant& variant, const std::vector<std::string>& captured = {});
  void use() const;
  uint32_t name() const { return handle_.name(); }

  /// Returns BadInput unless a stage declares a uniform of this name and GLSL type (for example "float") in
  /// any variant.
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
