#include <gmock/gmock.h>

#include <filesystem>
#include <set>
#include <sstream>

#include "common/base/file.h"
#include "common/gl/program.h"
#include "tests/support/gl_fixture.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::gl::compile_all_test {
namespace {

class CompileAll : public GlTest {};

/// Errors of every stage file in every variant it declares.
std::vector<std::string> compile_everything(const ShaderLibrary& library) {
  std::vector<std::string> errors;
  for (const std::string& path : library.stage_files()) {
    const auto flat = library.flatten(path);
    if (!flat) {
      errors.push_back(flat.error().to_string());
      continue;
    }
    for (const Variant& variant : covering_variants(flat->axes))
      if (const auto compiled = compile_stage(library, path, variant); !compiled)
        errors.push_back(compiled.error().to_string());
  }
  return errors;
}

TEST_F(CompileAll, EveryEmbeddedStageCompilesInEveryVariant) {
  EXPECT_THAT(compile_everything(ShaderLibrary()), testing::IsEmpty());
}

TEST_F(CompileAll, TheSourceFolderHoldsTheSameStages) {
  const ShaderLibrary folder(std::filesystem::path(STRANDCAST_SOURCE_DIR) / "shaders");
  EXPECT_EQ(folder.stage_files(), ShaderLibrary().stage_files()) << "the program was built from other files";
}

/// Rows of the table of files in shaders/README.md: "sim/dftl.comp", "render/head.*".
std::set<std::string> rows_of_readme(const std::filesystem::path& shaders) {
  std::set<std::string> rows;
  std::istringstream lines(load_text(shaders / "README.md", 1u << 20).value());
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("| `")) rows.insert(line.substr(3, line.find('`', 3) - 3));
  return rows;
}

TEST(ShaderFiles, HaveARowEachInTheReadme) {
  const auto shaders = std::filesystem::path(STRANDCAST_SOURCE_DIR) / "shaders";
  std::set<std::string> unused = rows_of_readme(shaders);
  const std::set<std::string> rows = unused;
  const std::set<std::string> kKinds = {".h", ".glsl", ".comp", ".vert", ".tesc", ".tese", ".geom", ".frag"};
  for (const auto& entry : std::filesystem::recursive_directory_iterator(shaders)) {
    if (!kKinds.contains(entry.path().extension().string())) continue;
    const std::filesystem::path file = std::filesystem::relative(entry.path(), shaders);
    const std::string all_stages = std::filesystem::path(file).replace_extension(".*").string();
    EXPECT_TRUE(rows.contains(file.string()) || rows.contains(all_stages)) << file << " has no row";
    unused.erase(file.string());
    unused.erase(all_stages);
  }
  EXPECT_THAT(unused, testing::IsEmpty());
}

TEST_F(CompileAll, FindsTheOneVariantThatIsBroken) {
  TemporaryFolder folder;
  folder.write("a.comp",
               "#pragma variant A 0 1\n#pragma variant B 0 1\nlayout(local_size_x = 1) in;\nvoid main() {\n"
               "#if A == 1 && B == 1\n  broken;\n#endif\n}\n");
  const auto errors = compile_everything(ShaderLibrary(folder.path()));
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_THAT(errors.front(), testing::AllOf(testing::HasSubstr("A=1 B=1"), testing::HasSubstr("a.comp:6")));
}

}  // namespace
}  // namespace strandcast::gl::compile_all_test
