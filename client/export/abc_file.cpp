#include "client/export/abc_file.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

namespace strandcast {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

constexpr uint64_t kBlockBit = uint64_t{1} << 63;
constexpr uint64_t kNoBlock = kBlockBit, kNoGroup = 0;
constexpr uint64_t kFinishedAt = 5, kRootAt = 8;
constexpr int32_t kFileVersion = 0, kLayoutVersion = 10'812;  // the layout is that of Alembic 1.8.12
constexpr size_t kMostIndexed = 254, kMostIndexedChars = 255;
constexpr uint8_t kInline = 255;

uint64_t mixed(uint64_t value) {
  value = (value ^ value >> 33) * 0xff51afd7ed558ccdull;
  value = (value ^ value >> 33) * 0xc4ceb9fe1a85ec53ull;
  return value ^ value >> 33;
}

template <class T>
void put(std::string& text, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  text.append(raw, sizeof(T));
}

void put_number(std::string& text, uint64_t value, uint32_t width) {
  char raw[sizeof(value)];
  std::memcpy(raw, &value, sizeof(value));
  text.append(raw, width);
}

AbcKey key_of_text(std::string_view text) {
  return murmur_key(std::as_bytes(std::span(text)));
}

/// First sample that differs from sample 0 and last one that differs from the one before it; 0 if none does.
std::pair<uint64_t, uint64_t> changes_of(const AbcSeries& series) {
  uint64_t first = 0, last = 0;
  for (size_t i = 1; i < series.sample.size(); ++i) {
    if (first == 0 && series.sample[i].key != series.sample[0].key) first = i;
    if (series.sample[i].key != series.sample[i - 1].key) last = i;
  }
  return {first, last};
}

}  // namespace

AbcKey murmur_key(std::span<const std::byte> bytes) {
  constexpr uint64_t kFirst = 0x87c37b91114253d5ull, kSecond = 0x4cf5ad432745937full;
  constexpr size_t kBlockBytes = 16;
  uint64_t low = 0, high = 0;
  const auto low_part = [](uint64_t word) { return std::rotl(word * kFirst, 31) * kSecond; };
  const auto high_part = [](uint64_t word) { return std::rotl(word * kSecond, 33) * kFirst; };
  const uint64_t size_bytes = bytes.size();
  for (; bytes.size() >= kBlockBytes; bytes = bytes.subspan(kBlockBytes)) {
    AbcKey word;
    std::memcpy(word.data(), bytes.data(), kBlockBytes);
    low = (std::rotl(low ^ low_part(word[0]), 27) + high) * 5 + 0x52dce729;
    high = (std::rotl(high ^ high_part(word[1]), 31) + low) * 5 + 0x38495ab5;
  }
  AbcKey rest{};
  if (!bytes.empty()) std::memcpy(rest.data(), bytes.data(), bytes.size());
  low ^= low_part(rest[0]) ^ size_bytes;
  high ^= high_part(rest[1]) ^ size_bytes;
  low += high;
  high += low;
  low = mixed(low);
  high = mixed(high);
  low += high;
  return {low, high + low};
}

Result<AbcFile> AbcFile::create(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(OutputFile output, OutputFile::create(path));
  AbcFile file(std::move(output));
  std::string header = "Ogawa";
  header += '\0';  // not finished
  header += '\0';
  header += '\1';  // version 1, high byte first
  put(header, uint64_t{0});
  RETURN_IF_ERROR(file.file_.append(header));
  return file;
}

Result<uint64_t> AbcFile::append_block(std::string_view bytes) {
  if (bytes.empty()) return kNoBlock;
  const uint64_t offset = file_.size_bytes();
  std::string size;
  put(size, static_cast<uint64_t>(bytes.size()));
  RETURN_IF_ERROR(file_.append(size));
  RETURN_IF_ERROR(file_.append(bytes));
  return offset | kBlockBit;
}

Result<uint64_t> AbcFile::append_group(std::span<const uint64_t> children) {
  if (children.empty()) return kNoGroup;
  const uint64_t offset = file_.size_bytes();
  std::string text;
  put(text, static_cast<uint64_t>(children.size()));
  for (const uint64_t child : children) put(text, child);
  RETURN_IF_ERROR(file_.append(text));
  return offset;
}

Status AbcFile::append(AbcSeries& series, std::span<const std::byte> bytes) {
  AbcSeries::Kept kept{kNoBlock, murmur_key(bytes)};
  if (!series.sample.empty() && series.sample.back().key == kept.key) {
    series.sample.push_back(series.sample.back());
    return {};
  }
  if (!bytes.empty()) {
    kept.child = file_.size_bytes() | kBlockBit;
    std::string begin;
    put(begin, static_cast<uint64_t>(bytes.size() + sizeof(AbcKey)));
    put(begin, kept.key);
    RETURN_IF_ERROR(file_.append(begin));
    RETURN_IF_ERROR(file_.append({reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
  }
  series.sample.push_back(kept);
  return {};
}

Result<uint64_t> AbcFile::append_series(const AbcEntry& entry) {
  std::vector<uint64_t> children;
  const auto [first, last] = changes_of(entry.series);
  for (size_t i = 0; i < entry.series.sample.size(); ++i) {
    if (i > 0 && (first == 0 || i < first || i > last)) continue;
    children.push_back(entry.series.sample[i].child);
    if (entry.form != AbcForm::Array) continue;
    // Dimensions: the number of bytes says all, but of texts.
    std::string dimensions;
    if (entry.series.text_count > 0) put(dimensions, entry.series.text_count);
    ASSIGN_OR_RETURN(const uint64_t child, append_block(dimensions));
    children.push_back(child);
  }
  if (entry.times >= most_samples_.size()) most_samples_.resize(entry.times + size_t{1}, 0);
  most_samples_[entry.times] = std::max<uint64_t>(most_samples_[entry.times], entry.series.sample.size());
  return append_group(children);
}

uint8_t AbcFile::metadata_index(const std::string& metadata) {
  if (metadata.empty()) return 0;
  const auto known = std::find(indexed_metadata_.begin(), indexed_metadata_.end(), metadata);
  const auto index = static_cast<size_t>(known - indexed_metadata_.begin());
  if (known == indexed_metadata_.end()) {
    if (index == kMostIndexed || metadata.size() > kMostIndexedChars) return kInline;
    indexed_metadata_.push_back(metadata);
  }
  return static_cast<uint8_t>(index + 1);
}

std::string AbcFile::header_of(const AbcEntry& entry) {
  const uint8_t metadata = metadata_index(entry.metadata);
  const auto [first, last] = changes_of(entry.series);
  const uint64_t count = entry.series.sample.size();
  const uint64_t largest =
      std::max({uint64_t{entry.name.size()}, uint64_t{entry.metadata.size()}, count, uint64_t{entry.times}});
  const uint32_t hint = largest <= 0xff ? 0 : largest <= 0xffff ? 1 : 2;
  const uint32_t width = 1u << hint;
  const bool is_compound = entry.form == AbcForm::Compound;
  const bool is_constant = first == 0;
  const bool has_changes = !is_constant && (first != 1 || last != count - 1);
  const bool is_homogenous = entry.form == AbcForm::Scalar || entry.extent == 1;
  uint32_t info = static_cast<uint32_t>(entry.form) | hint << 2 | uint32_t{metadata} << 20;
  if (!is_compound)
    info |= static_cast<uint32_t>(entry.type) << 4 | (entry.times != 0 ? 1u << 8 : 0u) |
            (has_changes ? 1u << 9 : 0u) | (is_homogenous ? 1u << 10 : 0u) | (is_constant ? 1u << 11 : 0u) |
            entry.extent << 12;
  std::string text;
  put(text, info);
  if (!is_compound) {
    put_number(text, count, width);
    if (has_changes) put_number(text, first, width);
    if (has_changes) put_number(text, last, width);
    if (entry.times != 0) put_number(text, entry.times, width);
  }
  put_number(text, entry.name.size(), width);
  text += entry.name;
  if (metadata == kInline) {
    put_number(text, entry.metadata.size(), width);
    text += entry.metadata;
  }
  return text;
}

Result<AbcFile::Written> AbcFile::append_compound(const std::vector<AbcEntry>& entries) {
  Written written;
  if (entries.empty()) return written;
  std::vector<uint64_t> children;
  std::string headers, content;
  for (const AbcEntry& entry : entries) {
    headers += header_of(entry);
    content += entry.name + '\0' + entry.metadata + '\0';
    if (entry.form == AbcForm::Compound) {
      ASSIGN_OR_RETURN(const Written inner, append_compound(entry.entries));
      children.push_back(inner.child);
      put(content, inner.hash);
      continue;
    }
    ASSIGN_OR_RETURN(const uint64_t child, append_series(entry));
    children.push_back(child);
    for (const AbcSeries::Kept& kept : entry.series.sample) put(content, kept.key);
  }
  ASSIGN_OR_RETURN(const uint64_t headers_child, append_block(headers));
  children.push_back(headers_child);
  ASSIGN_OR_RETURN(written.child, append_group(children));
  written.hash = key_of_text(content);
  return written;
}

Result<AbcFile::Written> AbcFile::append_item(const AbcItem& item) {
  std::vector<uint64_t> children(1);
  std::string headers, content;
  for (const AbcItem& inner : item.items) {
    ASSIGN_OR_RETURN(const Written written, append_item(inner));
    children.push_back(written.child);
    put(headers, static_cast<uint32_t>(inner.name.size()));
    headers += inner.name;
    const uint8_t metadata = metadata_index(inner.metadata);
    headers += static_cast<char>(metadata);
    if (metadata == kInline) {
      put(headers, static_cast<uint32_t>(inner.metadata.size()));
      headers += inner.metadata;
    }
    content += inner.name + '\0' + inner.metadata + '\0';
    put(content, written.hash);
  }
  ASSIGN_OR_RETURN(const Written properties, append_compound(item.entries));
  children.front() = properties.child;
  const AbcKey items_hash = item.items.empty() ? AbcKey{} : key_of_text(content);
  put(headers, properties.hash);
  put(headers, items_hash);
  ASSIGN_OR_RETURN(const uint64_t headers_child, append_block(headers));
  children.push_back(headers_child);
  Written written;
  ASSIGN_OR_RETURN(written.child, append_group(children));
  std::string both;
  put(both, properties.hash);
  put(both, items_hash);
  written.hash = key_of_text(both);
  return written;
}

std::string AbcFile::times_text(std::span<const AbcEvenTimes> times) const {
  std::string text;
  for (size_t i = 0; i <= times.size(); ++i) {
    const AbcEvenTimes even = i == 0 ? AbcEvenTimes{} : times[i - 1];
    put(text, static_cast<uint32_t>(i < most_samples_.size() ? most_samples_[i] : 0));
    put(text, even.step_s);
    put(text, uint32_t{1});
    put(text, even.first_s);
  }
  return text;
}

Result<uint64_t> AbcFile::finish(const AbcItem& top, std::string_view metadata,
                                 std::span<const AbcEvenTimes> times) {
  std::array<uint64_t, 6> root{};
  std::string number;
  put(number, kFileVersion);
  ASSIGN_OR_RETURN(root[0], append_block(number));
  number.clear();
  put(number, kLayoutVersion);
  ASSIGN_OR_RETURN(root[1], append_block(number));
  ASSIGN_OR_RETURN(const Written written, append_item(top));
  root[2] = written.child;
  ASSIGN_OR_RETURN(root[3], append_block(metadata));
  ASSIGN_OR_RETURN(root[4], append_block(times_text(times)));
  std::string indexed;
  for (const std::string& text : indexed_metadata_) {
    indexed += static_cast<char>(text.size());
    indexed += text;
  }
  ASSIGN_OR_RETURN(root[5], append_block(indexed));
  ASSIGN_OR_RETURN(const uint64_t root_child, append_group(root));
  std::string at;
  put(at, root_child);
  RETURN_IF_ERROR(file_.patch(kRootAt, at));
  RETURN_IF_ERROR(file_.patch(kFinishedAt, "\xff"));
  const uint64_t bytes = file_.size_bytes();
  RETURN_IF_ERROR(file_.finish());
  return bytes;
}

}  // namespace strandcast
