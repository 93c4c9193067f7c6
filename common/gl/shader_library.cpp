#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <regex>
#include <set>
#include <tuple>

#include "common/base/file.h"
#include "common/gl/embedded_shaders.h"
#include "common/gl/program.h"

namespace strandcast::gl {
namespace {

constexpr uint64_t kMaxShaderFileBytes = 1u << 20;
constexpr size_t kMaxVariants = 2048;  // of one stage file
constexpr size_t kFewVariants = 64;    // so many are all compiled by a test, of more some
constexpr std::array<std::string_view, 6> kStageExtensions = {".vert", ".tesc", ".tese",
                                                              ".geom", ".frag", ".comp"};

std::string place(const std::string& file, uint32_t line) {
  return fmt::format("{}:{}", file, line);
}

/// Words of a line, "# include" read as "#include".
std::vector<std::string> split_words(std::string_view line) {
  std::vector<std::string> words;
  std::string word;
  for (const char c : line) {
    const bool is_space = c == ' ' || c == '\t' || c == '\r';
    if (!is_space) word += c;
    if (is_space && !word.empty() && word != "#") words.push_back(std::exchange(word, {}));
  }
  if (!word.empty()) words.push_back(word);
  return words;
}

Result<VariantAxis> parse_axis(const std::vector<std::string>& words) {
  if (words.size() < 4)
    return make_error(ErrorCode::BadInput, "a variant needs a name and at least one value");
  VariantAxis axis{words[2], {}};
  for (size_t i = 3; i < words.size(); ++i) {
    if (words[i].starts_with("//")) break;
    int value = 0;
    const char* end = words[i].data() + words[i].size();
    const auto parsed = std::from_chars(words[i].data(), end, value);
    if (parsed.ec != std::errc() || parsed.ptr != end)
      return make_error(ErrorCode::BadInput, "'{}' of variant {} is no integer", words[i], axis.name);
    if (std::find(axis.values.begin(), axis.values.end(), value) != axis.values.end())
      return make_error(ErrorCode::BadInput, "variant {} lists {} twice", axis.name, value);
    axis.values.push_back(value);
  }
  if (axis.values.empty())
    return make_error(ErrorCode::BadInput, "variant {} needs at least one value", axis.name);
  return axis;
}

/// Walks one stage file and everything it includes, depth first.
class Flattener {
 public:
  using Load = std::function<Result<std::string>(const std::string&)>;
  explicit Flattener(Load load) : load_(std::move(load)) {}

  Status add_file(const std::string& path, const std::string& included_from) {
    auto text = load_(path);
    if (!text) {
      Error error = text.error();
      if (!included_from.empty()) error.message += fmt::format(", included from {}", included_from);
      return error;
    }
    const auto file_index = static_cast<uint16_t>(flat_.files.size());
    flat_.files.push_back(path);
    open_.push_back(path);
    uint32_t line_number = 0;
    std::string_view rest = *text;
    while (!rest.empty()) {
      const size_t end = std::min(rest.find('\n'), rest.size());
      RETURN_IF_ERROR(add_line(rest.substr(0, end), file_index, ++line_number));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    open_.pop_back();
    return {};
  }

  FlatSource take() { return std::move(flat_); }

 private:
  Status add_line(std::string_view line, uint16_t file_index, uint32_t line_number) {
    const std::string here = place(flat_.files[file_index], line_number);
    const std::vector<std::string> words = split_words(line);
    const std::string first = words.empty() ? "" : words[0];
    bool is_ours = false;  // handled here, hidden from the compiler
    if (first == "#include") {
      RETURN_IF_ERROR(add_include(words, here));
      is_ours = true;
    } else if (first == "#version") {
      return at(here, make_error(ErrorCode::BadInput, "#version is set by the program, remove it"));
    } else if (first == "#pragma" && words.size() > 1 && words[1] == "variant") {
      RETURN_IF_ERROR(add_axis(words, here));
      is_ours = true;
    }
    if (!is_ours) flat_.text += line;
    flat_.text += '\n';
    flat_.line_origin.emplace_back(file_index, line_number);
    return {};
  }

  Status add_include(const std::vector<std::string>& words, const std::string& here) {
    const std::string name = words.size() > 1 ? words[1] : "";
    if (name.starts_with('<')) return {};
    if (name.size() < 3 || name.front() != '"' || name.back() != '"')
      return at(here, make_error(ErrorCode::BadInput, "#include needs a \"path\" below shaders/"));
    const std::string path = name.substr(1, name.size() - 2);
    if (std::find(open_.begin(), open_.end(), path) != open_.end())
      return at(here,
                make_error(ErrorCode::BadInput, "include cycle: {} -> {}", fmt::join(open_, " -> "), path));
    if (std::find(flat_.files.begin(), flat_.files.end(), path) != flat_.files.end()) return {};
    return add_file(path, here);
  }

  Status add_axis(const std::vector<std::string>& words, const std::string& here) {
    auto axis = parse_axis(words);
    if (!axis) return at(here, axis.error());
    for (const VariantAxis& known : flat_.axes) {
      if (known.name != axis->name) continue;
      if (known.values == axis->values) return {};
      return at(here, make_error(ErrorCode::BadInput, "variant {} is declared with values {} and {}",
                                 known.name, fmt::join(known.values, " "), fmt::join(axis->values, " ")));
    }
    flat_.axes.push_back(std::move(axis).value());
    return {};
  }

  Load load_;
  FlatSource flat_;
  std::vector<std::string> open_;
};

int value_of(const VariantAxis& axis, const Variant& variant) {
  const auto given = variant.find(axis.name);
  return given == variant.end() ? axis.values.front() : given->second;
}

bool is_stage_file(std::string_view path) {
  return std::any_of(kStageExtensions.begin(), kStageExtensions.end(),
                     [&](std::string_view extension) { return path.ends_with(extension); });
}

bool is_word_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

bool is_word(std::string_view token) {
  return !token.empty() && is_word_character(token.front());
}

/// Words and single other characters of GLSL, without blanks and `//` comments; empty at the end. A regular
/// expression takes longer for a shader than all else that is done to its text.
class TokenScan {
 public:
  explicit TokenScan(std::string_view text) : rest_(text) {}

  std::string_view next() {
    while (!rest_.empty()) {
      if (rest_.starts_with("//")) {
        rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size()));
      } else if (rest_.front() == ' ' || rest_.front() == '\n' || rest_.front() == '\t' ||
                 rest_.front() == '\r') {
        rest_.remove_prefix(1);
      } else {
        break;
      }
    }
    size_t length = rest_.empty() ? 0 : 1;
    if (is_word(rest_))
      while (length < rest_.size() && is_word_character(rest_[length])) ++length;
    const std::string_view token = rest_.substr(0, length);
    rest_.remove_prefix(length);
    return token;
  }

 private:
  std::string_view rest_;
};

}  // namespace

Result<std::string> ShaderLibrary::load(const std::string& path) const {
  const Error missing = at(path, make_error(ErrorCode::NotFound, "no such shader file"));
  if (!folder_) {
    for (const EmbeddedShader& shader : embedded_shaders())
      if (shader.path == path) return std::string(shader.text);
    return missing;
  }
  const std::filesystem::path relative(path);
  if (relative.is_absolute() || std::find(relative.begin(), relative.end(), "..") != relative.end())
    return at(path, make_error(ErrorCode::BadInput, "shader paths stay below the shader folder"));
  auto text = load_text(*folder_ / relative, kMaxShaderFileBytes);
  if (!text && text.error().code == ErrorCode::NotFound) return missing;
  return text;
}

Result<FlatSource> ShaderLibrary::flatten(const std::string& path) const {
  Flattener flattener([this](const std::string& file) { return load(file); });
  RETURN_IF_ERROR(flattener.add_file(path, ""));
  FlatSource source = flattener.take();
  size_t variant_count = 1;
  for (const VariantAxis& axis : source.axes) {
    variant_count *= axis.values.size();
    if (variant_count > kMaxVariants)
      return at(path, make_error(ErrorCode::LimitExceeded, "more than {} variants", kMaxVariants));
  }
  return source;
}

std::vector<std::string> ShaderLibrary::stage_files() const {
  std::vector<std::string> paths;
  if (folder_) {
    std::error_code failure;
    using Iterator = std::filesystem::recursive_directory_iterator;
    for (Iterator it(*folder_, failure), end; !failure && it != end; it.increment(failure))
      if (it->is_regular_file()) paths.push_back(it->path().lexically_relative(*folder_).generic_string());
  } else {
    for (const EmbeddedShader& shader : embedded_shaders()) paths.emplace_back(shader.path);
  }
  std::erase_if(paths, [](const std::string& path) { return !is_stage_file(path); });
  std::sort(paths.begin(), paths.end());
  return paths;
}

std::map<std::string, std::string> declared_uniforms(const FlatSource& source) {
  // Blocks have a brace where this wants a name. What is declared in an unused #if counts: another variant
  // has it.
  std::map<std::string, std::string> uniforms;
  TokenScan scan(source.text);
  for (std::string_view token = scan.next(); !token.empty();) {
    if (token != "uniform") {
      token = scan.next();
      continue;
    }
    std::string_view type = scan.next();
    if (type == "lowp" || type == "mediump" || type == "highp") type = scan.next();
    const std::string_view name = scan.next();
    token = scan.next();
    const bool is_declaration = token == ";" || token == "=" || token == "[";
    if (is_declaration && is_word(type) && is_word(name)) uniforms[std::string(name)] = type;
  }
  return uniforms;
}

std::vector<Variant> covering_variants(const std::vector<VariantAxis>& axes) {
  const std::vector<Variant> all = all_variants(axes);
  if (all.size() <= kFewVariants) return all;
  using Pair = std::tuple<size_t, int, size_t, int>;  // two axes with a value of each
  const auto pairs_of = [&](const Variant& variant) {
    std::vector<Pair> pairs;
    for (size_t i = 0; i < axes.size(); ++i)
      for (size_t j = i + 1; j < axes.size(); ++j)
        pairs.emplace_back(i, variant.at(axes[i].name), j, variant.at(axes[j].name));
    return pairs;
  };
  std::set<Pair> missing;
  for (const Variant& variant : all)
    for (const Pair& pair : pairs_of(variant)) missing.insert(pair);
  // Each time the one that brings most: within a factor of the fewest, and the same list every time.
  std::vector<Variant> chosen;
  while (!missing.empty()) {
    const Variant* best = nullptr;
    size_t most = 0;
    for (const Variant& variant : all) {
      const std::vector<Pair> pairs = pairs_of(variant);
      const auto brought = static_cast<size_t>(std::count_if(
          pairs.begin(), pairs.end(), [&](const Pair& pair) { return missing.contains(pair); }));
      if (brought > most) {
        most = brought;
        best = &variant;
      }
    }
    chosen.push_back(*best);
    for (const Pair& pair : pairs_of(*best)) missing.erase(pair);
  }
  return chosen;
}

std::vector<Variant> all_variants(const std::vector<VariantAxis>& axes) {
  std::vector<Variant> variants{{}};
  for (const VariantAxis& axis : axes) {
    std::vector<Variant> longer;
    for (const Variant& variant : variants) {
      for (const int value : axis.values) {
        longer.push_back(variant);
        longer.back()[axis.name] = value;
      }
    }
    variants = std::move(longer);
  }
  return variants;
}

std::string variant_header(const FlatSource& source, const Variant& variant) {
  std::string header = "#version 450 core\n";
  for (const VariantAxis& axis : source.axes)
    header += fmt::format("#define {} {}\n", axis.name, value_of(axis, variant));
  return header;
}

std::string describe_variant(const FlatSource& source, const Variant& variant) {
  std::vector<std::string> chosen;
  for (const VariantAxis& axis : source.axes)
    chosen.push_back(fmt::format("{}={}", axis.name, value_of(axis, variant)));
  return fmt::format("{}", fmt::join(chosen, " "));
}

std::string map_compiler_log(const FlatSource& source, uint32_t header_lines, const std::string& log) {
  static const std::regex kPlace(R"(\b0(?::([0-9]{1,8})(?:\([0-9]+\))?|\(([0-9]{1,8})\)))");
  std::string mapped;
  std::string::const_iterator rest = log.begin();
  std::smatch match;
  while (std::regex_search(rest, log.end(), match, kPlace)) {
    mapped.append(rest, match[0].first);
    const uint64_t line = std::stoul(match[1].matched ? match[1].str() : match[2].str());
    const uint64_t flat_line = line > header_lines ? line - header_lines : 0;
    if (flat_line == 0 || flat_line > source.line_origin.size()) {
      mapped += match[0].str();
    } else {
      const auto [file_index, file_line] = source.line_origin[flat_line - 1];
      mapped += place(source.files[file_index], file_line);
    }
    rest = match[0].second;
  }
  mapped.append(rest, log.end());
  return mapped;
}

}  // namespace strandcast::gl
