// Tables of a program's options: what each changes of the structs that are parsed, and that it changes
// nothing else. A test says the fields of its structs by OPTION_FIELDS in functions tell() of this namespace;
// a field that is left out does not compile.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <vector>

namespace strandcast::test {

/// Fields as text, by their paths: "net.port" is "7878".
struct FieldTexts : std::map<std::string, std::string> {
  using std::map<std::string, std::string>::map;
};

template <class T>
concept TextList = requires(const T& value) {
  value.size(), value.begin();
}
&&!std::is_convertible_v<const T&, std::filesystem::path>;
template <class T>
concept TextOptional = requires(const T& value) {
  value.has_value(), *value;
};
template <class T>
concept Told = requires(FieldTexts& told, const T& value) {
  tell(told, std::string(), value);
};

/// A value as a table says it; "none" for one that is not there.
template <class T>
std::string text_of(const T& value) {
  if constexpr (std::is_same_v<T, bool>) {
    return value ? "true" : "false";
  } else if constexpr (std::is_enum_v<T>) {
    return fmt::format("{}", static_cast<int64_t>(value));
  } else if constexpr (std::is_arithmetic_v<T>) {
    return fmt::format("{}", value);
  } else if constexpr (std::is_convertible_v<const T&, std::filesystem::path>) {
    return std::filesystem::path(value).string();
  } else if constexpr (requires { value.x, value.y, value.z; }) {
    return fmt::format("{} {} {}", value.x, value.y, value.z);
  } else if constexpr (TextOptional<T>) {
    return value ? text_of(*value) : "none";
  } else if constexpr (TextList<T>) {
    std::string text;
    for (const auto& one : value) text += (text.empty() ? "" : " ") + text_of(one);
    return text;
  } else {
    return value ? "some" : "none";  // a function or a pointer
  }
}

template <class T>
void add_field(FieldTexts& told, const std::string& path, const T& value) {
  if constexpr (Told<T>) {
    tell(told, path + ".", value);
  } else if constexpr (TextOptional<T>) {
    using Value = std::remove_cvref_t<decltype(*value)>;
    if constexpr (Told<Value>) {
      told[path] = value ? "some" : "none";
      if (value) tell(told, path + ".", *value);
    } else {
      told[path] = text_of(value);
    }
  } else {
    told[path] = text_of(value);
  }
}

template <class... Values>
void add_fields(FieldTexts& told, const std::string& where, const char* names, const Values&... values) {
  std::istringstream words(names);
  const auto add = [&](const auto& value) {
    std::string name;
    words >> name;
    while (!name.empty() && name.back() == ',') name.pop_back();
    add_field(told, where + name, value);
  };
  (add(values), ...);
}

/// All fields of `value`, by their names in order, told as `where` and the name.
#define OPTION_FIELDS(value, ...)    \
  const auto& [__VA_ARGS__] = value; \
  add_fields(told, where, #__VA_ARGS__, __VA_ARGS__)

struct OptionRow {
  std::string option;               // as --help lists it: "--port", or a positional's name
  std::vector<std::string> values;  // that stand behind it
  std::map<std::string, std::string> changed;
  std::vector<std::string> beside = {};  // what it needs in front of it; the first fields are of this alone
  std::string command = {};              // that stands first, where a program has several
};

/// The names of options and positionals that a help page lists, but for --help and --version.
inline std::set<std::string> options_in_help(const std::string& help) {
  std::set<std::string> names;
  std::istringstream lines(help);
  bool is_of_options = true;
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line[0] != ' ') is_of_options = line != "Subcommands:";
    if (!is_of_options || line.size() < 3 || !line.starts_with("  ") || line[2] == ' ') continue;
    std::istringstream all(line.substr(2, line.find_first_of(" {", 2) - 2));  // "--no-pictures{false}"
    for (std::string name; std::getline(all, name, ',');)
      if (name != "-h" && name != "--help" && name != "--version") names.insert(name);
  }
  return names;
}

/// What differs between two structs; the empty text for a field that is no longer there.
inline std::map<std::string, std::string> difference_of(const FieldTexts& before, const FieldTexts& after) {
  std::map<std::string, std::string> changed;
  for (const auto& [path, text] : after) {
    const auto old = before.find(path);
    if (old == before.end() || old->second != text) changed[path] = text;
  }
  for (const auto& [path, text] : before)
    if (!after.contains(path)) changed[path] = {};
  return changed;
}

inline std::vector<std::string> words_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

using Arguments = std::vector<std::string>;

/// `fields_of`: FieldTexts of a command line without the program's name; nothing where it is refused.
template <class FieldsOf>
void expect_changes(std::span<const OptionRow> rows, const FieldsOf& fields_of) {
  for (const OptionRow& row : rows) {
    SCOPED_TRACE(row.command + " " + row.option);
    Arguments arguments = words_of(row.command);
    arguments.insert(arguments.end(), row.beside.begin(), row.beside.end());
    const std::optional<FieldTexts> before = fields_of(arguments);
    if (row.option.starts_with('-')) arguments.push_back(row.option);
    arguments.insert(arguments.end(), row.values.begin(), row.values.end());
    const std::optional<FieldTexts> after = fields_of(arguments);
    if (!before || !after) {
      ADD_FAILURE() << "it is refused";
      continue;
    }
    EXPECT_EQ(difference_of(*before, *after), row.changed);
  }
}

/// How far a number may go, and what is next to that.
struct OptionRange {
  std::string option;
  std::string below, low, high, above;  // below: empty where nothing is
  std::vector<std::string> beside = {};
};

/// `is_taken`: whether a command line is accepted.
template <class IsTaken>
void expect_ranges(std::span<const OptionRange> ranges, const IsTaken& is_taken) {
  for (const OptionRange& range : ranges) {
    const auto with = [&](const std::string& value) {
      Arguments arguments = range.beside;
      arguments.push_back(range.option + "=" + value);  // a number below 0 is no option
      return is_taken(arguments);
    };
    EXPECT_TRUE(with(range.low)) << range.option << " " << range.low;
    EXPECT_TRUE(with(range.high)) << range.option << " " << range.high;
    EXPECT_FALSE(!range.below.empty() && with(range.below)) << range.option << " " << range.below;
    EXPECT_FALSE(with(range.above)) << range.option << " " << range.above;
    EXPECT_FALSE(with("nan")) << range.option;
  }
}

/// Every option of the help page has a row, and every row's is there.
inline void expect_all_options(std::span<const OptionRow> rows, const std::string& help,
                               const std::string& command = {}) {
  std::set<std::string> named;
  for (const OptionRow& row : rows)
    if (row.command == command) named.insert(row.option);
  EXPECT_EQ(named, options_in_help(help)) << command;
}

}  // namespace strandcast::test
