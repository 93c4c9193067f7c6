// Turns the errors of protobuf's text parser into one error with line and column. Private to common/scene.
#pragma once

#include <google/protobuf/io/tokenizer.h>

#include <string>

#include "common/base/result.h"

namespace strandcast {

/// Returns "file:3:7" for a line and column that count from 0.
std::string place_at(const std::string& place, int line, int column);

/// Keeps the parser's first error; an unknown field gets the list of known ones.
class TextErrors : public google::protobuf::io::ErrorCollector {
 public:
  void AddError(int line, int column, const std::string& message) override;
  Error error(const std::string& place) const;

 private:
  std::string known() const;

  bool has_error_ = false;
  int line_ = 0, column_ = 0;
  std::string message_ = "not protobuf text";
};

}  // namespace strandcast
