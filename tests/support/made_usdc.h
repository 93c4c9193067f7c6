// Binary USD put together byte by byte, as other programs would write it: packing of its own, versions and
// widths by choice.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace strandcast::test {

/// A prim (6), an attribute (1) or the root (7), with values by their names and what is in it.
struct MadeSpec {
  std::string name;
  int32_t kind = 6;
  std::vector<std::pair<std::string, uint64_t>> fields;
  std::vector<MadeSpec> items;
};

template <class T>
std::string raw_bytes(const std::vector<T>& items) {
  return {reinterpret_cast<const char*>(items.data()), items.size() * sizeof(T)};
}

/// Bytes behind a zero as one block of LZ4 that is all literals.
inline std::string literal_block(const std::string& bytes) {
  std::string block("\0\xf0", 2);
  if (bytes.size() < 15) {
    block[1] = static_cast<char>(bytes.size() << 4);
    return block + bytes;
  }
  const size_t rest = bytes.size() - 15;
  return block + std::string(rest / 255, '\xff') + static_cast<char>(rest % 255) + bytes;
}

/// Numbers by their differences, of which `common` takes no byte and each other one the least that it needs.
inline std::string coded_ints(const std::vector<int32_t>& numbers, int32_t common) {
  std::string codes((numbers.size() + 3) / 4, '\0'), rest;
  int32_t before = 0;
  for (size_t i = 0; i < numbers.size(); ++i) {
    const auto step = static_cast<int32_t>(static_cast<uint32_t>(numbers[i]) - static_cast<uint32_t>(before));
    before = numbers[i];
    const int code = step == common                   ? 0
                     : step >= -128 && step < 128     ? 1
                     : step >= -32768 && step < 32768 ? 2
                                                      : 3;
    codes[i / 4] = static_cast<char>(codes[i / 4] | code << 2 * (i % 4));
    constexpr std::array<size_t, 4> kWidths = {0, 1, 2, 4};
    rest.append(reinterpret_cast<const char*>(&step), kWidths[static_cast<size_t>(code)]);
  }
  return std::string(reinterpret_cast<const char*>(&common), sizeof(common)) + codes + rest;
}

class MadeUsdc {
 public:
  static constexpr uint64_t kArray = uint64_t{1} << 63, kInlined = uint64_t{1} << 62,
                            kPacked = uint64_t{1} << 61;

  explicit MadeUsdc(uint8_t minor = 8) : minor_(minor) {
    text_ = "PXR-USDC";
    text_ += std::string({'\0', static_cast<char>(minor)});
    text_.resize(88);
    token_index("");  // number 0 has no sign, which properties need
  }

  static uint64_t rep(int type, uint64_t payload, uint64_t flags = 0) {
    return flags | static_cast<uint64_t>(type) << 48 | payload;
  }
  static uint64_t inlined(int type, uint64_t payload) { return rep(type, payload, kInlined); }
  uint64_t token(const std::string& text) { return inlined(11, token_index(text)); }
  uint64_t string(const std::string& text) {
    strings_.push_back(static_cast<uint32_t>(token_index(text)));
    return inlined(10, strings_.size() - 1);
  }
  uint32_t token_index(const std::string& text) {
    const auto [known, is_new] = token_index_.emplace(text, static_cast<uint32_t>(tokens_.size()));
    if (is_new) tokens_.push_back(text);
    return known->second;
  }
  /// Appends bytes; returns where they are.
  uint64_t put(const std::string& bytes) {
    text_ += bytes;
    return text_.size() - bytes.size();
  }
  template <class T>
  uint64_t put_number(T number) {
    return put(raw_bytes(std::vector<T>{number}));
  }
  uint64_t scalar(int type, const std::string& bytes) { return rep(type, put(bytes)); }
  /// An array as its version counts it.
  uint64_t array(int type, uint64_t count, const std::string& bytes, uint64_t flags = 0) {
    if (count == 0) return rep(type, 0, kArray);
    const uint64_t at = text_.size();
    if (minor_ < 5) put_number(uint32_t{1});
    if (minor_ < 7) {
      put_number(static_cast<uint32_t>(count));
    } else {
      put_number(count);
    }
    put(bytes);
    return rep(type, at, kArray | flags);
  }
  static std::string packed_ints(const std::vector<int32_t>& numbers, int32_t common = 1) {
    const std::string block = literal_block(coded_ints(numbers, common));
    return raw_bytes(std::vector<uint64_t>{block.size()}) + block;
  }
  uint64_t ints(const std::vector<int32_t>& numbers, int32_t common = 0) {
    if (minor_ < 5 || numbers.size() < 16) return array(3, numbers.size(), raw_bytes(numbers));
    return array(3, numbers.size(), packed_ints(numbers, common), kPacked);
  }
  std::string token_bytes(const std::vector<std::string>& texts) {
    std::vector<uint32_t> indices;
    for (const std::string& text : texts) indices.push_back(token_index(text));
    return raw_bytes(indices);
  }
  uint64_t tokens(const std::vector<std::string>& texts) {
    return array(11, texts.size(), token_bytes(texts));
  }
  uint64_t token_vector(const std::vector<std::string>& texts) {
    const std::string bytes = token_bytes(texts);
    const uint64_t at = put_number(static_cast<uint64_t>(texts.size()));
    put(bytes);
    return rep(41, at);
  }
  uint64_t samples(const std::vector<double>& times, const std::vector<uint64_t>& values) {
    const uint64_t times_at = put_number(static_cast<uint64_t>(times.size()));
    put(raw_bytes(times));
    const uint64_t at = text_.size();
    // Each distance leads past what a writer may have put between.
    const std::string gap = "gap";
    put_number(static_cast<int64_t>(sizeof(int64_t) + gap.size()));
    put(gap);
    put_number(rep(48, times_at));
    put_number(static_cast<int64_t>(sizeof(int64_t) + gap.size()));
    put(gap);
    put_number(static_cast<uint64_t>(values.size()));
    put(raw_bytes(values));
    return rep(46, at);
  }

  static MadeSpec attribute(const std::string& name, uint64_t value) {
    return {name, 1, {{"default", value}}, {}};
  }
  static MadeSpec moving(const std::string& name, uint64_t samples) {
    return {name, 1, {{"timeSamples", samples}}, {}};
  }
  MadeSpec prim(const std::string& name, const std::string& type, std::vector<MadeSpec> items) {
    MadeSpec made{name, 6, {{"specifier", inlined(42, 0)}}, std::move(items)};
    if (!type.empty()) made.fields.emplace_back("typeName", token(type));
    return made;
  }

  /// Writes the sections; `layer` are the fields of the root.
  std::string finish(std::vector<MadeSpec> prims, std::vector<std::pair<std::string, uint64_t>> layer = {}) {
    add({"", 7, std::move(layer), std::move(prims)});
    std::string joined;
    for (const std::string& text : tokens_) joined += text + '\0';
    const std::string block = literal_block(joined);
    section("TOKENS", counted(tokens_.size()) + counted(joined.size()) + counted(block.size()) + block);
    section("STRINGS", counted(strings_.size()) + raw_bytes(strings_));
    const std::string values = literal_block(raw_bytes(field_values_));
    section("FIELDS",
            counted(field_names_.size()) + packed_ints(field_names_) + counted(values.size()) + values);
    section("FIELDSETS", counted(field_sets_.size()) + packed_ints(field_sets_));
    const uint64_t paths = path_.size();
    section("PATHS", counted(paths) + counted(paths) + packed_ints(path_) + packed_ints(element_) +
                         packed_ints(jump_, -2));
    section("SPECS", counted(paths) + packed_ints(path_) + packed_ints(set_) + packed_ints(kind_, 0));
    const uint64_t contents = put_number(static_cast<uint64_t>(sections_.size()));
    for (const Section& one : sections_) {
      std::string name = one.name;
      name.resize(16);
      put(name + counted(one.begin) + counted(one.size));
    }
    std::memcpy(text_.data() + 16, &contents, sizeof(contents));
    return text_;
  }

 private:
  struct Section {
    std::string name;
    uint64_t begin, size;
  };

  static std::string counted(uint64_t count) { return raw_bytes(std::vector<uint64_t>{count}); }
  void section(const std::string& name, const std::string& bytes) {
    sections_.push_back({name, put(bytes), bytes.size()});
  }
  /// A path is followed by what is in it, and jumps to its sibling.
  void add(MadeSpec made, bool has_sibling = false) {
    const size_t own = path_.size();
    path_.push_back(static_cast<int32_t>(own));
    const auto token = static_cast<int32_t>(token_index(made.name));
    element_.push_back(made.kind == 1 ? -token : token);
    jump_.push_back(0);
    std::vector<std::string> children;
    for (const MadeSpec& item : made.items)
      if (item.kind == 6) children.push_back(item.name);
    if (!children.empty()) made.fields.emplace_back("primChildren", token_vector(children));
    set_.push_back(static_cast<int32_t>(field_sets_.size()));
    kind_.push_back(made.kind);
    for (const auto& [name, value] : made.fields) {
      field_sets_.push_back(static_cast<int32_t>(field_names_.size()));
      field_names_.push_back(static_cast<int32_t>(token_index(name)));
      field_values_.push_back(value);
    }
    field_sets_.push_back(-1);
    for (size_t i = 0; i < made.items.size(); ++i) add(std::move(made.items[i]), i + 1 < made.items.size());
    const auto behind = static_cast<int32_t>(path_.size() - own);
    jump_[own] = made.items.empty() ? (has_sibling ? 0 : -2) : (has_sibling ? behind : -1);
  }

  const uint8_t minor_;
  std::string text_;
  std::vector<std::string> tokens_;
  std::map<std::string, uint32_t> token_index_;
  std::vector<uint32_t> strings_;
  std::vector<int32_t> field_names_, field_sets_, path_, element_, jump_, set_, kind_;
  std::vector<uint64_t> field_values_;
  std::vector<Section> sections_;
};

}  // namespace strandcast::test
