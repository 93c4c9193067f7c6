// ValueTree: a tree of values as JSON (RFC 8259) and CBOR (RFC 8949) have them, for small documents from
// outside. Depth, number of values and text are bounded while reading, and nothing is allocated for a count
// that is only claimed. Pure functions, any thread.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

/// Limits of a document that is read; what passes them is refused.
inline constexpr size_t kMaxTreeDepth = 16;
inline constexpr size_t kMaxTreeValues = 4096;

struct ValueTree {
  using List = std::vector<ValueTree>;
  using Map = std::vector<std::pair<std::string, ValueTree>>;  // in the order of the document
  std::variant<std::monostate, bool, double, std::string, List, Map> value;

  /// Returns the value of a key, the first where several are the same; null without one or in no map.
  const ValueTree* find(std::string_view key) const;
  // Of what this is; empty or null for another kind.
  std::optional<double> number() const;
  std::optional<bool> truth() const;
  const std::string* text() const { return std::get_if<std::string>(&value); }
  const List* list() const { return std::get_if<List>(&value); }
};

/// Read a whole document. BadInput says what is wrong and at which byte; LimitExceeded names the limit.
/// CBOR's byte strings, tags and values without a kind in JSON are read as nothing, tags are left out.
Result<ValueTree> read_json(std::string_view text);
Result<ValueTree> read_cbor(std::span<const std::byte> bytes);

/// Write a document. Numbers keep every bit; those that are not finite become null in JSON.
std::string write_json(const ValueTree& tree);
std::vector<std::byte> write_cbor(const ValueTree& tree);

}  // namespace strandcast
