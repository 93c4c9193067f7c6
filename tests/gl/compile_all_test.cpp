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

/// Whether a shader says what it does before anything else.
bool begins_with_a_comment(const std::string& text) {
  return text.starts_with("// ");
}

TEST(ShaderFiles, BeginWithWhatTheyDo) {
  const auto shaders = std::filesystem::path(STRANDCAST_SOURCE_DIR) / "shaders";
  const std::set<std::string> kKinds = {".h", ".glsl", ".comp", ".vert", ".tesc", ".tese", ".geom", ".frag"};
  size_t count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(shaders)) {
    if (!kKinds.contains(entry.path().extension().string())) continue;
    EXPECT_TRUE(begins_with_a_comment(load_text(entry.path(), 1u << 20).value())) << entry.path();
    ++count;
  }
  EXPECT_GT(count, 100u);
  EXPECT_FALSE(begins_with_a_comment("void main() {}"));
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
