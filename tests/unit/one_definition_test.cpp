// Reads the headers of the tree and fails where two of them give one name to two things, which no compiler
// sees as long as no file includes both.
#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "common/base/file.h"

namespace strandcast::one_definition_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

/// Types and constants that a header defines in namespaces with a name, each behind its namespace.
std::set<std::string> names_of(const std::string& text) {
  static const std::regex kNamespace("^(?:inline )?namespace ([A-Za-z0-9_:]*) ?\\{.*");
  static const std::regex kType(
      "^(?:enum class|enum|struct|class) (?:\\[\\[[a-z]+\\]\\] )?(\\w+)\\b(?!::)[^;]*\\{.*");
  static const std::regex kConstant("\\b(k[A-Z]\\w*)(?: = |\\{|\\[)");
  std::set<std::string> names;
  std::vector<std::string> spaces;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::smatch found;
    if (std::regex_match(line, found, kNamespace)) {
      spaces.push_back(found[1]);
      continue;
    }
    if (line.starts_with("}  // namespace")) {
      if (!spaces.empty()) spaces.pop_back();
      continue;
    }
    const bool is_unnamed = std::find(spaces.begin(), spaces.end(), "") != spaces.end();
    if (spaces.empty() || is_unnamed) continue;
    const std::string prefix = fmt::format("{}::", fmt::join(spaces, "::"));
    if (std::regex_match(line, found, kType)) names.insert(prefix + found[1].str());
    if (!line.starts_with("inline constexpr ")) continue;
    for (auto at = std::sregex_iterator(line.begin(), line.end(), kConstant); at != std::sregex_iterator();
         ++at)
      names.insert(prefix + (*at)[1].str());
  }
  return names;
}

/// "name: file, file" of every name that several files define.
std::vector<std::string> defined_twice(const std::map<std::string, std::string>& text_by_path) {
  std::map<std::string, std::vector<std::string>> paths_by_name;
  for (const auto& [path, text] : text_by_path)
    for (const std::string& name : names_of(text)) paths_by_name[name].push_back(path);
  std::vector<std::string> twice;
  for (const auto& [name, paths] : paths_by_name)
    if (paths.size() > 1) twice.push_back(fmt::format("{}: {}", name, fmt::join(paths, ", ")));
  return twice;
}

TEST(OneDefinition, EveryNameOfAHeaderIsThatOfOneThing) {
  const std::filesystem::path root(STRANDCAST_SOURCE_DIR);
  std::map<std::string, std::string> text_by_path;
  for (const char* top : {"common", "server", "client", "tests"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / top)) {
      const std::string path = entry.path().lexically_relative(root).generic_string();
      if (!path.ends_with(".h")) continue;
      auto text = load_text(entry.path(), 1u << 20);
      ASSERT_TRUE(text) << text.error().to_string();
      text_by_path[path] = std::move(*text);
    }
  }
  EXPECT_GT(text_by_path.size(), 300u) << "the walk did not find the headers";
  EXPECT_THAT(defined_twice(text_by_path), IsEmpty());
}

TEST(OneDefinition, FindsTypesAndConstants) {
  EXPECT_THAT(names_of("namespace strandcast {\n"
                       "enum class Up { Y, Z };\n"
                       "struct Later;\n"
                       "class [[nodiscard]] Held final : public Other {\n"
                       "  struct Inner {};\n"
                       "};\n"
                       "inline constexpr int kOne = 1, kTwo = kOne;\n"
                       "inline constexpr std::chrono::milliseconds kWait{20};\n"
                       "namespace {\n"
                       "inline constexpr int kOwn = 1;\n"
                       "}  // namespace\n"
                       "}  // namespace strandcast\n"),
              UnorderedElementsAre("strandcast::Up", "strandcast::Held", "strandcast::kOne",
                                   "strandcast::kTwo", "strandcast::kWait"));
  EXPECT_THAT(
      defined_twice(
          {{"a.h",
            "namespace strandcast {\ninline constexpr size_t kShare = 2;\n}  // namespace strandcast\n"},
           {"b.h",
            "namespace strandcast {\ninline constexpr double kShare = 0.125;\n}  // namespace strandcast\n"},
           {"c.h",
            "namespace strandcast::net {\ninline constexpr int kShare = 3;\n}  // namespace "
            "strandcast::net\n"}}),
      ElementsAre("strandcast::kShare: a.h, b.h"));
}

}  // namespace
}  // namespace strandcast::one_definition_test
