#include "client/export/usdc_file.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "common/base/crc32.h"

namespace strandcast {
namespace {

constexpr uint8_t kMinorVersion = 8;
constexpr size_t kAlignedBytes = 8;
constexpr uint8_t kPrependedList = 32, kExplicitList = 3;
// A package: ZIP (APPNOTE 4.3), with contents that begin at a multiple of 64 bytes.
constexpr size_t kPackageAlignedBytes = 64, kMemberHeaderBytes = 30, kExtraHeadBytes = 4;
constexpr uint16_t kZipVersion = 10, kPaddingId = 0x1986;
constexpr uint16_t kFirstDay = 1 << 5 | 1;  // 1 January 1980: the same strands are the same bytes

template <class T>
std::string usdc_number(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof(T)};
}

template <class T>
std::string_view text_of(std::span<const T> items) {
  return {reinterpret_cast<const char*>(items.data()), items.size_bytes()};
}

/// Packed bytes behind their number.
std::string behind_size(const std::string& packed) {
  return usdc_number(uint64_t{packed.size()}) + packed;
}

std::string coded(std::span<const int32_t> numbers) {
  return behind_size(pack_usdc_ints(numbers));
}

}  // namespace

Result<UsdcFile> UsdcFile::create(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(OutputFile output, OutputFile::create(path));
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  UsdcFile file(std::move(output), extension == ".usdz" ? path.stem().string() + ".usdc" : std::string());
  if (!file.member_.empty()) RETURN_IF_ERROR(file.begin_package());
  // Not finished: where the contents are is said at the end.
  RETURN_IF_ERROR(file.file_.append(std::string(kUsdcHeaderBytes, '\0')));
  file.token({});  // number 0 has no sign, which properties need
  return file;
}

Status UsdcFile::append(std::string_view bytes) {
  crc_ = crc32(std::as_bytes(std::span(bytes)), crc_);
  if (!member_.empty() && file_.size_bytes() + bytes.size() > std::numeric_limits<uint32_t>::max())
    return make_error(ErrorCode::LimitExceeded, "a .usdz holds 4 GiB: export .usdc, or less");
  return file_.append(bytes);
}

/// Returns where the bytes are.
Result<uint64_t> UsdcFile::append_aligned(std::string_view bytes) {
  RETURN_IF_ERROR(append(std::string((kAlignedBytes - at() % kAlignedBytes) % kAlignedBytes, '\0')));
  const uint64_t offset = at();
  RETURN_IF_ERROR(append(bytes));
  return offset;
}

UsdcValue UsdcFile::token(const std::string& text) {
  const auto [known, is_new] = token_index_.emplace(text, static_cast<uint32_t>(tokens_.size()));
  if (is_new) tokens_.push_back(text);
  return UsdcValue::of(UsdcType::Token, known->second, UsdcValue::kInlined);
}

UsdcValue UsdcFile::string(const std::string& text) {
  strings_.push_back(static_cast<uint32_t>(token(text).payload()));
  return UsdcValue::of(UsdcType::String, strings_.size() - 1, UsdcValue::kInlined);
}

Result<UsdcValue> UsdcFile::number(double value) {
  const auto narrow = static_cast<float>(value);
  if (static_cast<double>(narrow) == value)
    return UsdcValue::of(UsdcType::Double, std::bit_cast<uint32_t>(narrow), UsdcValue::kInlined);
  ASSIGN_OR_RETURN(const uint64_t offset, append_aligned(usdc_number(value)));
  return UsdcValue::of(UsdcType::Double, offset);
}

Result<UsdcValue> UsdcFile::array(UsdcType type, size_t count, std::span<const std::byte> bytes) {
  if (count == 0) return UsdcValue::of(type, 0, UsdcValue::kArray);
  ASSIGN_OR_RETURN(const uint64_t offset, append_aligned(usdc_number(uint64_t{count})));
  RETURN_IF_ERROR(append(text_of(bytes)));
  return UsdcValue::of(type, offset, UsdcValue::kArray);
}

Result<UsdcValue> UsdcFile::ints(std::span<const int32_t> numbers) {
  if (numbers.size() < kLeastUsdcPacked) return array(UsdcType::Int, numbers.size(), std::as_bytes(numbers));
  ASSIGN_OR_RETURN(const uint64_t offset,
                   append_aligned(usdc_number(uint64_t{numbers.size()}) + coded(numbers)));
  return UsdcValue::of(UsdcType::Int, offset, UsdcValue::kArray | UsdcValue::kPacked);
}

Result<UsdcValue> UsdcFile::strings(std::span<const std::string> texts) {
  std::map<std::string_view, uint32_t> known;  // many strands have the same
  std::vector<uint32_t> indices;
  for (const std::string& text : texts) {
    const auto [index, is_new] = known.emplace(text, 0);
    if (is_new) index->second = static_cast<uint32_t>(string(text).payload());
    indices.push_back(index->second);
  }
  return array(UsdcType::String, indices.size(), std::as_bytes(std::span(indices)));
}

Result<UsdcValue> UsdcFile::tokens(std::span<const std::string> texts) {
  std::string bytes = usdc_number(uint64_t{texts.size()});
  for (const std::string& text : texts) bytes += usdc_number(static_cast<uint32_t>(token(text).payload()));
  ASSIGN_OR_RETURN(const uint64_t offset, append_aligned(bytes));
  return UsdcValue::of(UsdcType::TokenVector, offset);
}

Result<UsdcValue> UsdcFile::prepended_tokens(std::span<const std::string> texts) {
  std::string bytes = usdc_number(kPrependedList) + usdc_number(uint64_t{texts.size()});
  for (const std::string& text : texts) bytes += usdc_number(static_cast<uint32_t>(token(text).payload()));
  ASSIGN_OR_RETURN(const uint64_t offset, append_aligned(bytes));
  return UsdcValue::of(UsdcType::TokenListOp, offset);
}

Result<UsdcValue> UsdcFile::target(uint32_t item) {
  ASSIGN_OR_RETURN(const uint64_t offset,
                   append_aligned(usdc_number(kExplicitList) + usdc_number(uint64_t{1}) + usdc_number(item)));
  return UsdcValue::of(UsdcType::PathListOp, offset);
}

Result<UsdcValue> UsdcFile::samples(std::span<const double> times, std::span<const UsdcValue> values) {
  std::string bytes = usdc_number(uint64_t{times.size()});
  bytes += text_of(times);
  ASSIGN_OR_RETURN(const uint64_t times_at, append_aligned(bytes));
  // Two distances, each to what follows it at once: the value of the times, and the values.
  const std::string distance = usdc_number(int64_t{sizeof(int64_t)});
  bytes = distance + usdc_number(UsdcValue::of(UsdcType::DoubleVector, times_at)) + distance +
          usdc_number(uint64_t{values.size()});
  bytes += text_of(values);
  ASSIGN_OR_RETURN(const uint64_t offset, append_aligned(bytes));
  return UsdcValue::of(UsdcType::TimeSamples, offset);
}

/// Numbers what is in an item behind it; the names of prims and properties are values of their own.
Status UsdcFile::append_item(UsdcItem item, bool has_sibling) {
  const size_t own = element_.size();
  const auto name = static_cast<int32_t>(token(item.name).payload());
  const bool is_property = item.kind == UsdcKind::Attribute || item.kind == UsdcKind::Relationship;
  element_.push_back(is_property ? -name : name);
  kind_.push_back(static_cast<int32_t>(item.kind));
  jump_.push_back(0);
  std::vector<std::string> prims, properties;
  for (const UsdcItem& inner : item.items)
    (inner.kind == UsdcKind::Prim ? prims : properties).push_back(inner.name);
  for (const auto& [field, names] : {std::pair("primChildren", &prims), {"properties", &properties}}) {
    if (names->empty()) continue;
    ASSIGN_OR_RETURN(const UsdcValue list, tokens(*names));
    item.fields.emplace_back(field, list);
  }
  set_.push_back(static_cast<int32_t>(field_sets_.size()));
  for (const auto& [field, value] : item.fields) {
    field_sets_.push_back(static_cast<int32_t>(field_names_.size()));
    field_names_.push_back(static_cast<int32_t>(token(field).payload()));
    field_values_.push_back(value);
  }
  field_sets_.push_back(-1);
  constexpr int32_t kChildOnly = -1, kLeaf = -2, kSiblingOnly = 0;
  for (size_t i = 0; i < item.items.size(); ++i)
    RETURN_IF_ERROR(append_item(std::move(item.items[i]), i + 1 < item.items.size()));
  const auto to_sibling = static_cast<int32_t>(element_.size() - own);
  jump_[own] = item.items.empty() ? (has_sibling ? kSiblingOnly : kLeaf)
               : has_sibling      ? to_sibling
                                  : kChildOnly;
  return {};
}

Status UsdcFile::append_section(std::string_view name, const std::string& bytes) {
  ASSIGN_OR_RETURN(const uint64_t begin, append_aligned(bytes));
  sections_.push_back({name, begin, bytes.size()});
  return {};
}

Status UsdcFile::append_sections() {
  const auto count = [](const auto& items) { return usdc_number(uint64_t{items.size()}); };
  const auto packed = [](std::string_view bytes) {
    return behind_size(pack_usdc_bytes(std::as_bytes(std::span(bytes))));
  };
  std::string names;
  for (const std::string& text : tokens_) names += text + '\0';
  RETURN_IF_ERROR(append_section("TOKENS", count(tokens_) + count(names) + packed(names)));
  RETURN_IF_ERROR(
      append_section("STRINGS", count(strings_) + std::string(text_of(std::span<const uint32_t>(strings_)))));
  RETURN_IF_ERROR(append_section("FIELDS", count(field_names_) + coded(field_names_) +
                                               packed(text_of(std::span<const UsdcValue>(field_values_)))));
  RETURN_IF_ERROR(append_section("FIELDSETS", count(field_sets_) + coded(field_sets_)));
  std::vector<int32_t> paths;
  for (size_t i = 0; i < element_.size(); ++i) paths.push_back(static_cast<int32_t>(i));
  RETURN_IF_ERROR(
      append_section("PATHS", count(paths) + count(paths) + coded(paths) + coded(element_) + coded(jump_)));
  return append_section("SPECS", count(paths) + coded(paths) + coded(set_) + coded(kind_));
}

Result<uint64_t> UsdcFile::finish(UsdcItem root) {
  RETURN_IF_ERROR(append_item(std::move(root), false));
  RETURN_IF_ERROR(append_sections());
  std::string contents = usdc_number(uint64_t{sections_.size()});
  for (const Section& section : sections_) {
    std::string name(section.name);
    name.resize(kUsdcSectionNameBytes);
    contents += name + usdc_number(section.begin) + usdc_number(section.size_bytes);
  }
  ASSIGN_OR_RETURN(const uint64_t contents_at, append_aligned(contents));
  std::string header(kUsdcMagic);
  header.resize(kUsdcHeaderBytes);
  header[kUsdcVersionAt + 1] = static_cast<char>(kMinorVersion);
  std::memcpy(header.data() + kUsdcContentsAt, &contents_at, sizeof(contents_at));
  RETURN_IF_ERROR(file_.patch(begin_, header));
  if (!member_.empty())
    RETURN_IF_ERROR(
        finish_package(joined_crc32(crc32(std::as_bytes(std::span(header))), crc_, at() - kUsdcHeaderBytes)));
  const uint64_t bytes = file_.size_bytes();
  RETURN_IF_ERROR(file_.finish());
  return bytes;
}

/// From the version on, as it stands before the member and in the list at the end.
std::string UsdcFile::member_header(uint32_t crc, uint32_t size_bytes) const {
  const uint16_t flags = 0, method = 0, time = 0;
  return usdc_number(kZipVersion) + usdc_number(flags) + usdc_number(method) + usdc_number(time) +
         usdc_number(kFirstDay) + usdc_number(crc) + usdc_number(size_bytes) + usdc_number(size_bytes) +
         usdc_number(static_cast<uint16_t>(member_.size()));
}

Status UsdcFile::begin_package() {
  // Of a size that no file has, until it is known.
  const std::string header = "PK\3\4" + member_header(0, std::numeric_limits<uint32_t>::max());
  const size_t used = kMemberHeaderBytes + member_.size() + kExtraHeadBytes;
  const size_t padding = (kPackageAlignedBytes - used % kPackageAlignedBytes) % kPackageAlignedBytes;
  RETURN_IF_ERROR(file_.append(header + usdc_number(static_cast<uint16_t>(kExtraHeadBytes + padding)) +
                               member_ + usdc_number(kPaddingId) +
                               usdc_number(static_cast<uint16_t>(padding)) + std::string(padding, '\0')));
  begin_ = file_.size_bytes();
  return {};
}

Status UsdcFile::finish_package(uint32_t crc) {
  const std::string header = member_header(crc, static_cast<uint32_t>(at()));
  constexpr uint64_t kBehindMagic = 4;
  RETURN_IF_ERROR(file_.patch(kBehindMagic, header));
  const auto list_at = static_cast<uint32_t>(file_.size_bytes());
  const std::string nothing(2, '\0');
  // No extra field, no comment, disk 0, no attributes; the member begins at byte 0.
  const std::string list = "PK\1\2" + usdc_number(kZipVersion) + header + std::string(16, '\0') + member_;
  RETURN_IF_ERROR(file_.append(list));
  const uint16_t one = 1;
  return file_.append("PK\5\6" + nothing + nothing + usdc_number(one) + usdc_number(one) +
                      usdc_number(static_cast<uint32_t>(list.size())) + usdc_number(list_at) + nothing);
}

}  // namespace strandcast
