// What is wrong with a command line, as one sentence: CLI11's own, but for a value that cannot be read, and
// for NaN, which CLI11 takes into every range.
#pragma once

#include <cmath>
#include <cstdlib>
#include <string>
#include <string_view>

namespace strandcast {

/// Returns the sentence for `said`, the text of a CLI::ParseError. For a value of the wrong kind it names the
/// option and the value.
inline std::string command_line_error(std::string_view said) {
  constexpr std::string_view kNotRead = "Could not convert: ", kIs = " = ";
  const size_t is = said.find(kIs);
  if (!said.starts_with(kNotRead) || is == std::string_view::npos) return std::string(said);
  const std::string_view option = said.substr(kNotRead.size(), is - kNotRead.size());
  return std::string(option) + " cannot be '" + std::string(said.substr(is + kIs.size())) + "'";
}

/// Returns such a sentence of a program, and where help is: for CLI::App::failure_message().
template <class App, class Failure>
std::string command_line_failure(const App* app, const Failure& failure) {
  return app->get_name() + ": " + command_line_error(failure.what()) + " (--help lists the options)\n";
}

/// Returns `range`, a CLI::Range, which then refuses NaN too.
template <class Range>
Range without_nan(Range range) {
  range.operation([inner = range](std::string& text) {
    if (std::isnan(std::strtod(text.c_str(), nullptr))) return "'" + text + "' is no number";
    return inner(text);
  });
  return range;
}

}  // namespace strandcast
