// AbcArchive: objects, properties, samples and times of an Alembic file, as its schemas build on them.
// Constant properties are never expanded. Untrusted input. Private to the loader; one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/groom/abc_container.h"

namespace strandcast {

inline constexpr uint64_t kMaxAbcObjects = 100'000;
inline constexpr uint64_t kMaxAbcProperties = 10'000;        // of one object or compound
inline constexpr uint64_t kMaxAbcHeaderBytes = 16ull << 20;  // of names and descriptions in one block
inline constexpr uint64_t kMaxAbcNameBytes = 1'024;

/// Element types, numbered as in the file.
enum class AbcPod : uint8_t {
  Bool,
  U8,
  I8,
  U16,
  I16,
  U32,
  I32,
  U64,
  I64,
  Half,
  Float,
  Double,
  String,
  WString
};

enum class AbcPropertyKind : uint8_t { Compound, Scalar, Array };

struct AbcProperty {
  std::string name;
  std::string metadata;
  AbcPropertyKind kind = AbcPropertyKind::Compound;
  AbcPod pod = AbcPod::Bool;
  uint32_t extent = 1;         // numbers of one element: 3 for a point
  uint64_t sample_count = 0;   // claimed, never allocated
  uint64_t first_changed = 0;  // first sample that differs from sample 0; 0 if none does
  uint64_t last_changed = 0;   // last sample that differs from the one before it
  uint64_t times = 0;          // index of its time sampling
  AbcChild child = 0;
};

struct AbcObject {
  std::string name;
  std::string metadata;
  AbcChild child = 0;
};

/// Elements of one sample, still as bytes.
struct AbcSample {
  std::vector<std::byte> bytes;
  AbcPod pod = AbcPod::Bool;
  uint32_t extent = 1;

  size_t count() const;
  /// Returns a number of an element; 0 for text and half floats.
  double number(size_t element, uint32_t axis = 0) const;
  /// Returns texts, each up to its NUL.
  std::vector<std::string> texts() const;
};

/// Returns the value of a key in the text of a description, "key=value;key=value"; empty if there is none.
std::string_view abc_metadata_value(std::string_view metadata, std::string_view key);

/// Returns the property of this name, or null.
const AbcProperty* find_abc_property(const std::vector<AbcProperty>& properties, std::string_view name);

class AbcArchive {
 public:
  static Result<AbcArchive> read(AbcContainer container);

  const std::string& metadata() const { return metadata_; }
  const AbcObject& top() const { return top_; }
  /// Reads the objects in an object.
  Result<std::vector<AbcObject>> objects(const AbcObject& parent) const;
  /// Reads the properties of an object.
  Result<std::vector<AbcProperty>> properties(const AbcObject& object) const;
  /// Reads the properties in a compound property; none for any other.
  Result<std::vector<AbcProperty>> properties(const AbcProperty& compound) const;
  /// Reads one sample; an index behind the last one stands for the last. BadInput for a sample that is not
  /// stored, LimitExceeded for one of more than `limit` elements.
  Result<AbcSample> sample(const AbcProperty& property, uint64_t index, uint64_t limit) const;
  /// Returns the time of a sample in seconds.
  double time_s(const AbcProperty& property, uint64_t index) const;
  /// Returns the sample nearest to a time; 0 if there is none.
  uint64_t nearest_sample(const AbcProperty& property, double time_s) const;

 private:
  struct Times {
    double cycle_s = 1.0;
    bool is_acyclic = false;
    std::vector<double> time_s;
  };
  struct HeaderScan;

  explicit AbcArchive(AbcContainer container) : container_(std::move(container)) {}
  Status read_times(const std::vector<std::byte>& bytes);
  Status read_indexed_metadata(const std::vector<std::byte>& bytes);
  Result<std::vector<AbcProperty>> read_properties(AbcChild compound) const;
  Result<AbcProperty> read_property(HeaderScan& scan) const;
  Result<std::string> metadata_at(HeaderScan& scan, uint32_t index, uint32_t width) const;

  AbcContainer container_;
  std::string metadata_;
  AbcObject top_;
  std::vector<Times> times_;
  std::vector<std::string> indexed_metadata_{std::string()};
};

}  // namespace strandcast
