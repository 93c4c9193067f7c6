#include "common/strands/asset/form.h"

#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/base/hash.h"
#include "common/strands/asset/numbers.h"
#include "common/strands/byte_io.h"
#include "common/strands/head/head_form.h"
#include "common/strands/wrapping.h"

namespace strandcast::asset {
namespace {

/// Of factors, the coarser first: what makes the same mesh will do.
constexpr std::array<uint32_t, 2> kFactorBits = {22, 30};
constexpr double kMostDrop = 2.0;  // in skull radii

std::atomic<bool> has_made_other_head{false};

uint64_t hash_of(const Mesh& mesh) {
  uint64_t hash = hash_bytes(std::as_bytes(std::span(mesh.position_m)));
  hash = hash_bytes(std::as_bytes(std::span(mesh.normal)), hash);
  return hash_bytes(std::as_bytes(std::span(mesh.triangle)), hash);
}

/// Factors of a grid as whole steps, each beside those before it in its row and column.
template <class Coder>
void code_factors(Coder& coder, std::vector<int32_t>& steps, size_t columns) {
  constexpr uint32_t kFactorKind = 0;
  uint32_t size = 0;
  for (size_t i = 0; i < steps.size(); ++i) {
    const bool has_above = i >= columns, has_left = i % columns > 0;
    int32_t expected = has_above ? steps[i - columns] : has_left ? steps[i - 1] : 0;
    if (has_above && has_left)
      expected = wrapping_sum(expected, wrapping_difference(steps[i - 1], steps[i - columns - 1]));
    int32_t left = 0;
    if constexpr (!Coder::kReads) left = wrapping_difference(steps[i], expected);
    coder.code(left, kFactorKind, size);
    if constexpr (Coder::kReads) steps[i] = wrapping_sum(expected, left);
    size = size / 2 + magnitude(left) / 2;
  }
}

/// Returns nothing where a factor is not above 0 and below 2.
std::vector<int32_t> steps_of(const std::vector<double>& factors, uint32_t bits) {
  std::vector<int32_t> steps;
  for (const double factor : factors) {
    const double step = std::floor(std::ldexp(factor, static_cast<int>(bits)) + 0.5);
    if (!(step >= 1.0 && step <= std::numeric_limits<int32_t>::max())) return {};
    steps.push_back(static_cast<int32_t>(step));
  }
  return steps;
}

std::vector<double> factors_of(const std::vector<int32_t>& steps, uint32_t bits) {
  std::vector<double> factors;
  for (const int32_t step : steps)
    factors.push_back(std::ldexp(static_cast<double>(step), -static_cast<int>(bits)));
  return factors;
}

bool has_even_pull(const HeadForm& form) {
  return form.pull == HeadForm().pull;
}

/// Returns false where the mesh is another one in these steps.
bool append_form_in(uint32_t bits, const Mesh& mesh, std::vector<std::byte>& destination) {
  const HeadForm& form = *mesh.form;
  const bool is_even = has_even_pull(form);
  std::vector<int32_t> width = steps_of(form.neck_width, bits), pull;
  if (!is_even) pull = steps_of(form.pull, bits);
  if (width.empty() || pull.empty() != is_even) return false;
  HeadForm told = form;
  told.neck_width = factors_of(width, bits);
  if (!is_even) told.pull = factors_of(pull, bits);
  const uint64_t hash = hash_of(mesh);
  if (hash_of(as_sent(make_head(told))) != hash) return false;
  ByteWriter writer(destination);
  writer.put(hash);
  for (int axis = 0; axis < 3; ++axis) writer.put(form.center_m[axis]);
  for (int axis = 0; axis < 3; ++axis) writer.put(form.radius_m[axis]);
  writer.put(form.drop);
  writer.put(static_cast<uint8_t>(bits));
  writer.put(static_cast<uint8_t>(is_even ? 0 : 1));
  NumberWriter numbers;
  code_factors(numbers, width, head::kNeckColumns);
  code_factors(numbers, pull, head::kSide);
  numbers.finish(destination);
  return true;
}

/// Checks what makes points finite and the mesh no larger than others may be.
Status check(const HeadForm& form) {
  bool is_good = form.drop >= 0.0 && form.drop <= kMostDrop;
  for (int axis = 0; axis < 3; ++axis)
    is_good = is_good && std::abs(form.center_m[axis]) <= double{kMaxMeshExtentM} &&
              form.radius_m[axis] > 0.0 && form.radius_m[axis] <= double{kMaxMeshExtentM};
  for (const std::vector<double>* factors : {&form.neck_width, &form.pull})
    for (const double factor : *factors) is_good = is_good && factor > 0.0;
  if (is_good) return {};
  return make_error(ErrorCode::BadInput, "the form of the asset's head is none");
}

/// Reads all but the hash.
Result<HeadForm> take_form(ByteReader& reader) {
  HeadForm form;
  for (int axis = 0; axis < 3; ++axis) form.center_m[axis] = reader.take<double>();
  for (int axis = 0; axis < 3; ++axis) form.radius_m[axis] = reader.take<double>();
  form.drop = reader.take<double>();
  const uint32_t bits = reader.take<uint8_t>(), has_pull = reader.take<uint8_t>();
  if (!reader.ok() || bits > kFactorBits.back() || has_pull > 1)
    return make_error(ErrorCode::BadInput, "the form of the asset's head has steps of 2^-{}, {} are allowed",
                      bits, kFactorBits.back());
  ValueReader values;
  ASSIGN_OR_RETURN(const auto rest, values.open(reader.rest()));
  NumberReader numbers(values);
  std::vector<int32_t> width(form.neck_width.size()), pull(has_pull != 0 ? form.pull.size() : 0);
  code_factors(numbers, width, head::kNeckColumns);
  code_factors(numbers, pull, head::kSide);
  if (!values.is_spent() || !rest.empty())
    return make_error(ErrorCode::BadInput, "the form of the asset's head does not end where it has to");
  form.neck_width = factors_of(width, bits);
  if (has_pull != 0) form.pull = factors_of(pull, bits);
  RETURN_IF_ERROR(check(form));
  return form;
}

}  // namespace

bool append_form(const Mesh& mesh, std::vector<std::byte>& destination) {
  if (mesh.form == nullptr) return false;
  for (const uint32_t bits : kFactorBits)
    if (append_form_in(bits, mesh, destination)) return true;
  return false;
}

Status read_form(std::span<const std::byte> source, const HeadCounts& counts, Mesh& mesh) {
  ByteReader reader(source);
  const auto hash = reader.take<uint64_t>();
  ASSIGN_OR_RETURN(const HeadForm form, take_form(reader));
  mesh = as_sent(make_head(form));
  if (mesh.position_m.size() != counts.vertices || mesh.triangle.size() != counts.triangles)
    return make_error(ErrorCode::BadInput, "the built-in head has not {} vertices and {} triangles",
                      counts.vertices, counts.triangles);
  if (hash_of(mesh) == hash) return {};
  has_made_other_head = true;
  return make_error(ErrorCode::Unavailable, "this program makes another built-in head than the server's");
}

bool makes_other_heads() {
  return has_made_other_head;
}

}  // namespace strandcast::asset
