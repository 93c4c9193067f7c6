// What is wrong with a command line, as one sentence: CLI11's own, but for a value that cannot be read.
#pragma once

#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

namespace strandcast {

/// Returns the sentence of an error. For a value of the wrong kind it names the option and the value.
inline std::string command_line_error(const CLI::Error& error) {
  constexpr std::string_view kNotRead = "Could not convert: ", kIs = " = ";
  const std::string text = error.what();
  const size_t is = text.find(kIs);
  if (!text.starts_with(kNotRead) || is == std::string::npos) return text;
  return text.substr(kNotRead.size(), is - kNotRead.size()) + " cannot be '" + text.substr(is + kIs.size()) +
         "'";
}

/// Says such a sentence and where help is, for CLI::App::failure_message().
inline std::string command_line_failure(const CLI::App* app, const CLI::Error& error) {
  return app->get_name() + ": " + command_line_error(error) + " (--help lists the options)\n";
}

}  // namespace strandcast
