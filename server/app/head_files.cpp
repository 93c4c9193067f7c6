#include "server/app/head_files.h"

#include <algorithm>
#include <set>
#include <string_view>

#include "common/base/result.h"

namespace strandcast {
namespace {

/// Names of files have room for so much besides what a person calls them.
constexpr size_t kMaxEndingChars = 30;

/// Whatever the locale says.
char lower(char character) {
  return character >= 'A' && character <= 'Z' ? static_cast<char>(character - 'A' + 'a') : character;
}

bool may_stay(char character) {
  const char small = lower(character);
  return (small >= 'a' && small <= 'z') || (small >= '0' && small <= '9') ||
         std::string_view("+-_").find(character) != std::string_view::npos;
}

std::string in_lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), lower);
  return text;
}

}  // namespace

std::vector<std::string> head_file_endings(const std::vector<std::string>& heads) {
  std::vector<std::string> endings;
  std::set<std::string> taken;
  for (size_t i = 0; i < heads.size(); ++i) {
    std::string ending;
    if (i > 0) {
      ending = fmt::format("-{}", heads[i].substr(0, kMaxEndingChars));
      std::replace_if(
          ending.begin(), ending.end(), [](char character) { return !may_stay(character); }, '_');
    }
    const std::string own = ending;
    for (size_t number = i + 1; !taken.insert(in_lower_case(ending)).second; ++number)
      ending = fmt::format("{}-{}", own, number);
    endings.push_back(ending);
  }
  return endings;
}

std::filesystem::path with_file_ending(const std::filesystem::path& path, const std::string& ending) {
  std::filesystem::path longer = path;
  return longer.replace_filename(path.stem().string() + ending + path.extension().string());
}

}  // namespace strandcast
