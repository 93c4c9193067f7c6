#include "common/gl/program.h"
#include "tests/support/gl_fixture.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::gl {
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
    for (const Variant& variant : all_variants(flat->axes))
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
  EXPECT_EQ(folder.stage_files(), ShaderLibrary().stage_files())
      << "a file is missing in shaders/CMakeLists.txt";
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
}  // namespace strandcast::gl
