// A second opinion on the shaders, from programs that share no code with any driver: Khronos' front end reads
// every stage in every variant, and what it makes of them must be valid SPIR-V. Needs no GL context.
#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "common/base/file.h"
#include "common/gl/program.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_grid.h"

namespace strandcast::gl::shader_validators_test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// One stage in one variant, as a file for other programs.
struct WrittenVariant {
  std::string stage;
  std::string values;  // of the variant, for people
  FlatSource flat;
  uint32_t header_lines = 0;
  std::string file;  // in the folder

  /// The places in a log, which are of the file, become those of the sources.
  std::string said(std::string log) const {
    const std::string named = file + ":";
    for (size_t at = log.find(named); at != std::string::npos; at = log.find(named))
      log.replace(at, named.size(), "0:");
    return stage + (values.empty() ? "" : " with " + values) + ": " +
           map_compiler_log(flat, header_lines, log);
  }
};

std::vector<WrittenVariant> write_variants(const ShaderLibrary& library, const TemporaryFolder& folder) {
  std::vector<WrittenVariant> written;
  for (const std::string& stage : library.stage_files()) {
    const auto flat = library.flatten(stage);
    if (!flat) {
      ADD_FAILURE() << flat.error().to_string();
      continue;
    }
    for (const Variant& variant : covering_variants(flat->axes)) {
      const std::string header = variant_header(*flat, variant);
      const auto lines = static_cast<uint32_t>(std::count(header.begin(), header.end(), '\n'));
      const std::string file =
          fmt::format("{}{}", written.size(), std::filesystem::path(stage).extension().string());
      folder.write(file, header + flat->text);
      written.push_back({stage, describe_variant(*flat, variant), *flat, lines, file});
    }
  }
  return written;
}

/// Runs a line of shell in the folder. Every program writes into files there, by which it is judged.
void run_in(const TemporaryFolder& folder, const std::string& line) {
  const std::string command = fmt::format("cd '{}' && {}", folder.path().string(), line);
  if (std::system(command.c_str()) != 0) return;
}

/// The first of many, so that a mistake in a shared file can be read.
std::vector<std::string> few(std::vector<std::string> errors) {
  constexpr size_t kShown = 4;
  if (errors.size() <= kShown) return errors;
  const size_t more = errors.size() - kShown;
  errors.resize(kShown);
  errors.push_back(fmt::format("and {} more", more));
  return errors;
}

std::string text_of(const std::filesystem::path& file) {
  constexpr uint64_t kMaxLogBytes = 16u << 20;
  const auto text = load_text(file, kMaxLogBytes);
  return text ? *text : "";
}

std::string lines_beginning_with(const std::string& start, const std::string& text) {
  std::istringstream lines(text);
  std::string chosen;
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with(start)) chosen += line + "\n";
  return chosen;
}

/// What the front end has against each file, in GLSL as drivers read it. One process for all of them.
std::vector<std::string> glsl_errors(const std::vector<WrittenVariant>& variants,
                                     const TemporaryFolder& folder) {
  std::string files;
  std::map<std::string, const WrittenVariant*> by_file;
  for (const WrittenVariant& variant : variants) {
    files += " " + variant.file;
    by_file[variant.file] = &variant;
  }
  run_in(folder, "glslangValidator" + files + " >front.log 2>&1");
  std::vector<std::string> errors;
  size_t read_count = 0;
  const WrittenVariant* current = nullptr;
  std::ifstream log(folder.path() / "front.log");
  for (std::string line; std::getline(log, line);) {
    if (by_file.contains(line)) {
      current = by_file[line];
      ++read_count;
    } else if (line.starts_with("ERROR: 0:") && current != nullptr) {
      errors.push_back(current->said(line));
    }
  }
  if (read_count != variants.size())
    errors.push_back(fmt::format("{} of {} files were read: {}", read_count, variants.size(),
                                 text_of(folder.path() / "front.log").substr(0, 200)));
  return errors;
}

/// What is wrong with the SPIR-V that `front_end` makes of each file. A front end takes longer to start than
/// to read a shader, so one process makes many modules.
std::vector<std::string> spirv_errors(
    const std::vector<WrittenVariant>& variants, const TemporaryFolder& folder,
    const std::string& front_end =
        "glslc -c --target-env=opengl4.5 -fauto-map-locations -fauto-bind-uniforms") {
  std::string files;
  for (const WrittenVariant& variant : variants) files += variant.file + "\n";
  folder.write("files", files);
  run_in(folder, fmt::format("xargs -P \"$(nproc)\" -n 32 {} <files >/dev/null 2>modules.log", front_end));
  run_in(folder,
         "xargs -P \"$(nproc)\" -I@ sh -c 'spirv-val --target-env opengl4.5 @.spv >@.log 2>&1 && touch @.ok' "
         "<files >/dev/null 2>&1");
  const std::string said = text_of(folder.path() / "modules.log");
  std::vector<std::string> errors;
  for (const WrittenVariant& variant : variants) {
    if (std::filesystem::exists(folder.path() / (variant.file + ".ok"))) continue;
    const bool was_made = std::filesystem::exists(folder.path() / (variant.file + ".spv"));
    errors.push_back(variant.said(was_made ? text_of(folder.path() / (variant.file + ".log"))
                                           : lines_beginning_with(variant.file + ":", said)));
  }
  return errors;
}

/// All of them in the whole grid, else the first of every stage: a process each takes most of the time here.
std::vector<WrittenVariant> on_this_grid(const std::vector<WrittenVariant>& variants) {
  if (test_grid() == TestGrid::Whole) return variants;
  std::map<std::string, WrittenVariant> first_by_stage;
  for (const WrittenVariant& variant : variants) first_by_stage.try_emplace(variant.stage, variant);
  std::vector<WrittenVariant> chosen;
  for (const auto& [stage, variant] : first_by_stage) chosen.push_back(variant);
  return chosen;
}

/// Stages of one name belong to one program; what one hands on, the other must take.
std::vector<std::string> link_errors(const std::vector<WrittenVariant>& variants,
                                     const TemporaryFolder& folder) {
  std::map<std::string, std::vector<const WrittenVariant*>> programs;
  for (const WrittenVariant& variant : variants) {
    auto& stages = programs[std::filesystem::path(variant.stage).replace_extension().string()];
    const bool is_default = stages.empty() || stages.back()->stage != variant.stage;
    if (is_default) stages.push_back(&variant);
  }
  std::vector<std::string> errors;
  for (const auto& [name, stages] : programs) {
    if (stages.size() < 2) continue;
    std::string files;
    for (const WrittenVariant* stage : stages) files += " " + stage->file;
    run_in(folder, "{ glslangValidator -l" + files + " && touch linked; } >link.log 2>&1");
    if (!std::filesystem::remove(folder.path() / "linked"))
      errors.push_back(name + ": " + text_of(folder.path() / "link.log"));
  }
  return errors;
}

class ShaderValidators : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(std::system("command -v glslangValidator >/dev/null && command -v glslc >/dev/null && "
                          "command -v spirv-val >/dev/null"),
              0)
        << "bash deploy/install_deps.sh glslang-tools glslc spirv-tools";
  }

  std::vector<WrittenVariant> write(const std::string& name, const std::string& text) {
    sources_.write(name, text);
    return write_variants(ShaderLibrary(sources_.path()), folder_);
  }

  TemporaryFolder sources_;
  TemporaryFolder folder_;
};

TEST_F(ShaderValidators, AcceptEveryVariantOfEveryStage) {
  const auto variants = write_variants(ShaderLibrary(), folder_);
  ASSERT_GE(variants.size(), ShaderLibrary().stage_files().size());
  EXPECT_THAT(few(glsl_errors(variants, folder_)), IsEmpty());
  EXPECT_THAT(few(spirv_errors(on_this_grid(variants), folder_)), IsEmpty());
  EXPECT_THAT(link_errors(variants, folder_), IsEmpty());
}

TEST_F(ShaderValidators, NameFileLineAndVariantOfWhatTheyRefuse) {
  sources_.write(
      "edge.glsl",
      "struct Edge {\n  float length;\n};\nfloat half_of(Edge edge) {\n  return 0.5 * edge.length;\n}\n");
  const auto variants = write("a.comp",
                              "#include \"edge.glsl\"\n#pragma variant A 0 1\nlayout(local_size_x = 1) in;\n"
                              "void main() {\n#if A == 1\n  undeclared = 1;\n#endif\n}\n");
  ASSERT_EQ(variants.size(), 2u);
  const auto errors = glsl_errors(variants, folder_);
  EXPECT_THAT(errors, testing::Contains(AllOf(HasSubstr("a.comp with A=0"), HasSubstr("edge.glsl:5"))));
  EXPECT_THAT(errors, testing::Not(testing::Contains(AllOf(HasSubstr("A=0"), HasSubstr("undeclared")))));
  EXPECT_THAT(
      spirv_errors(variants, folder_),
      ElementsAre(HasSubstr("edge.glsl:5"), AllOf(HasSubstr("a.comp with A=1"), HasSubstr("edge.glsl:5"))));
}

TEST_F(ShaderValidators, RefuseAModuleThatIsNoSpirv) {
  const auto variants = write("a.comp", "layout(local_size_x = 1) in;\nvoid main() {}\n");
  EXPECT_THAT(spirv_errors(variants, folder_), IsEmpty());
  std::filesystem::remove(folder_.path() / (variants.front().file + ".ok"));
  const auto front_end = folder_.write("writes_zeros", "#!/bin/sh\nhead -c 20 /dev/zero >\"$1.spv\"\n");
  std::filesystem::permissions(front_end, std::filesystem::perms::owner_all);
  EXPECT_THAT(spirv_errors(variants, folder_, "./writes_zeros"),
              ElementsAre(HasSubstr("Invalid SPIR-V magic")));
}

TEST_F(ShaderValidators, RefuseStagesThatDoNotFit) {
  sources_.write("a.vert",
                 "layout(location = 0) out vec2 place;\nvoid main() {\n  place = vec2(0.0);\n  gl_Position = "
                 "vec4(0.0);\n}\n");
  const auto variants = write("a.frag",
                              "layout(location = 0) in vec4 place;\nlayout(location = 0) out vec4 "
                              "color;\nvoid main() { color = place; }\n");
  EXPECT_THAT(glsl_errors(variants, folder_), IsEmpty());
  EXPECT_THAT(link_errors(variants, folder_), ElementsAre(HasSubstr("a: ")));
}

}  // namespace
}  // namespace strandcast::gl::shader_validators_test
