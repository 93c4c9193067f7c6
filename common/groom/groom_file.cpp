#include "common/groom/groom_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <span>
#include <string>

#include "common/base/file_kind.h"
#include "common/base/quantile.h"
#include "common/base/text.h"
#include "common/base/units.h"
#include "common/groom/abc_loader.h"
#include "common/groom/groom_parts.h"
#include "common/groom/hair_loader.h"
#include "common/groom/head_fit.h"
#include "common/groom/ply_loader.h"
#include "common/groom/resample.h"
#include "common/groom/tfx_loader.h"
#include "common/groom/tip_first.h"
#include "common/groom/usable_strands.h"
#include "common/groom/usd_loader.h"

namespace strandcast {
namespace {

Status check_options(const GroomFileOptions& options) {
  if (!std::isfinite(options.unit_m) || options.unit_m < 0.0f) {
    return make_error(ErrorCode::BadInput, "unit_m is {}, it has to be above 0, or 0 to be guessed",
                      options.unit_m);
  }
  const glm::vec3 origin = options.origin.value_or(glm::vec3(0.0f));
  if (!std::isfinite(origin.x) || !std::isfinite(origin.y) || !std::isfinite(origin.z))
    return make_error(ErrorCode::BadInput, "origin is ({}, {}, {}), it has to be finite", origin.x, origin.y,
                      origin.z);
  if (options.yaw_deg && !std::isfinite(*options.yaw_deg)) {
    return make_error(ErrorCode::BadInput, "yaw_deg is {}, it has to be finite", *options.yaw_deg);
  }
  const uint32_t count = options.vertex_count;
  if (count != 0 && (count < kMinVertexCount || count > kMaxVertexCount)) {
    return make_error(ErrorCode::BadInput, "vertex_count is {}, allowed are 0 (keep) and {} to {}", count,
                      kMinVertexCount, kMaxVertexCount);
  }
  return {};
}

/// The beginning of a file that is text, "" for any other.
std::string text_beginning(const std::filesystem::path& path) {
  constexpr size_t kLookedAtBytes = 512, kShownChars = 40;
  std::string begin(kLookedAtBytes, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<size_t>(file.gcount()));
  const bool has_controls = std::any_of(begin.begin(), begin.end(), [](unsigned char c) {
    return c < ' ' && c != '\t' && c != '\n' && c != '\r';
  });
  return has_controls ? std::string() : one_line(begin.substr(0, begin.find('\n')), kShownChars);
}

/// A file of another kind than its name says is called that.
Result<StatedGroom> of_its_kind(const std::filesystem::path& path, Result<StatedGroom> stated) {
  if (stated || stated.error().code == ErrorCode::NotFound) return stated;
  const std::string kind = likely_kind(path);
  // USD is found out by its bytes, whatever its name.
  if (kind.empty() || (is_usd_extension(path.extension().string()) && kind.find("USD") != std::string::npos))
    return stated;
  Error error = stated.error();
  error.message += "; " + kind;
  return error;
}

/// A file that is text where none is expected is called that, whatever its bytes mean as numbers.
Error call_text(const std::filesystem::path& path, Error error) {
  const std::string begin = text_beginning(path);
  const bool is_text_format = path.extension() == ".tfx" && begin.starts_with("version 2");
  if (begin.empty() || is_text_format) return error;
  std::string hint = likely_kind(path);
  if (hint.empty())
    hint = begin.starts_with("version https://git-lfs")
               ? "it only stands for a file that Git LFS keeps: fetch that one"
               : "a .hair file is binary, and a .tfx file too, or it begins with 'version 2.0'";
  return at(path.string(), make_error(ErrorCode::BadInput, "this is text, \"{}\", and no {} file: {}", begin,
                                      path.extension().string(), hint));
}

Result<StatedGroom> usable(const std::filesystem::path& path, Result<StatedGroom> stated) {
  if (stated) {
    auto usable = with_usable_strands(std::move(stated).value());
    return usable ? usable : call_text(path, at(path.string(), usable.error()));
  }
  if (stated.error().code == ErrorCode::NotFound) return stated;
  const Error called = call_text(path, stated.error());
  return text_beginning(path).empty() ? of_its_kind(path, called) : called;
}

Result<StatedGroom> load_by_extension(const std::filesystem::path& path, const GroomFileOptions& options) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".tfx") return usable(path, load_tfx(path, options.guides));
  if (extension == ".hair") return usable(path, load_hair(path));
  if (extension == ".abc") return of_its_kind(path, load_abc(path, options.guides));
  if (extension == ".ply") return of_its_kind(path, load_ply(path, options.strand_vertex_count));
  if (is_usd_extension(extension)) return of_its_kind(path, load_usd(path, options.guides));
  const Error unknown = make_error(
      ErrorCode::Unsupported,
      "unknown groom file extension '{}', known: .tfx, .hair, .ply, .usd, .usda, .usdc, .usdz, .abc",
      extension);
  return of_its_kind(path, at(path.string(), unknown));
}

uint32_t most_vertices(const Groom& groom) {
  uint32_t largest = 0;
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    largest = std::max(largest, groom.vertex_count(strand));
  }
  return largest;
}

uint32_t target_vertex_count(uint32_t most, uint32_t wanted) {
  return wanted != 0 ? wanted : std::clamp(most, kMinVertexCount, kMaxVertexCount);
}

/// Adds a part of the hair behind the others.
void join(StatedGroom& hair, StatedGroom part) {
  Groom& whole = hair.groom;
  const auto first = static_cast<uint32_t>(whole.rest_position_m.size());
  const uint32_t strands = part.groom.strand_count();
  part.labels = named(std::move(part.labels), strands, part.groom.name);
  pad_labels(hair.labels, whole.strand_count(), first);
  pad_labels(part.labels, strands, part.groom.rest_position_m.size());
  join_labels(hair.labels, part.labels);
  whole.root_uv.resize(whole.strand_count(), glm::vec2(NAN));
  part.groom.root_uv.resize(strands, glm::vec2(NAN));
  whole.root_uv.insert(whole.root_uv.end(), part.groom.root_uv.begin(), part.groom.root_uv.end());
  whole.name += " + " + part.groom.name;
  for (size_t strand = 1; strand < part.groom.offset.size(); ++strand)
    whole.offset.push_back(first + part.groom.offset[strand]);
  whole.rest_position_m.insert(whole.rest_position_m.end(), part.groom.rest_position_m.begin(),
                               part.groom.rest_position_m.end());
  whole.pinned.insert(whole.pinned.end(), part.groom.pinned.begin(), part.groom.pinned.end());
}

/// All files of the options in file units, each with what it says.
Result<std::vector<GroomPart>> load_each(const GroomFileOptions& options) {
  if (options.more_paths.size() + 1 > kMaxGroomFiles)
    return make_error(ErrorCode::LimitExceeded, "{} groom files, at most {} make one head of hair",
                      options.more_paths.size() + 1, kMaxGroomFiles);
  std::vector<std::filesystem::path> paths = {options.path};
  paths.insert(paths.end(), options.more_paths.begin(), options.more_paths.end());
  std::vector<GroomPart> parts;
  std::optional<bool> is_z_up;
  uint64_t vertex_total = 0;
  for (const std::filesystem::path& path : paths) {
    ASSIGN_OR_RETURN(StatedGroom part, load_by_extension(path, options));
    vertex_total += part.groom.rest_position_m.size();
    if (vertex_total > kMaxGroomVertices)
      return at(path.string(), make_error(ErrorCode::LimitExceeded,
                                          "{} vertices with the files before it, at most {} are allowed",
                                          vertex_total, kMaxGroomVertices));
    if (is_z_up && part.is_z_up && *is_z_up != *part.is_z_up)
      return at(path.string(),
                make_error(ErrorCode::BadInput,
                           "it states another up axis than the files before it: parts share one"));
    if (part.is_z_up) is_z_up = part.is_z_up;
    if (const std::string turned = turn_tips_first(part.groom, part.labels); !turned.empty())
      part.notes.push_back(fmt::format("{}: {}", path.filename().string(), turned));
    parts.push_back({path, std::move(part)});
  }
  return parts;
}

struct JoinedParts {
  StatedGroom whole;
  std::string apart;  // as unify_units()
};

/// All files as one, in one unit; the first that states a unit or an up axis does so for all.
Result<JoinedParts> load_parts(const GroomFileOptions& options) {
  ASSIGN_OR_RETURN(std::vector<GroomPart> parts, load_each(options));
  std::string apart = parts.size() > 1 ? unify_units(parts) : std::string();
  StatedGroom whole = std::move(parts.front().stated);
  if (parts.size() > 1)
    whole.labels = named(std::move(whole.labels), whole.groom.strand_count(), whole.groom.name);
  for (size_t i = 1; i < parts.size(); ++i) {
    StatedGroom& part = parts[i].stated;
    if (!whole.material.is_known()) whole.material = part.material;
    if (!whole.unit_m) whole.unit_reason = part.unit_reason;
    if (!whole.is_z_up) whole.up_axis_reason = part.up_axis_reason;
    if (part.unit_m) whole.unit_m = part.unit_m;
    if (part.is_z_up) whole.is_z_up = part.is_z_up;
    whole.notes.insert(whole.notes.end(), part.notes.begin(), part.notes.end());
    join(whole, std::move(part));
  }
  if (parts.size() > 1)
    if (std::string note = fill_lacking(whole.groom, whole.labels); !note.empty())
      whole.notes.push_back(std::move(note));
  return JoinedParts{std::move(whole), std::move(apart)};
}

std::string unit_text(float unit_m) {
  return unit_m < 0.5f ? fmt::format("{:.4g} mm", unit_m * kMmPerM) : fmt::format("{:.4g} m", unit_m);
}

/// What to say of a unit with which the head under this hair is none of a person; empty where it may be one.
std::string unlikely_head(float unit_m, const Groom& groom) {
  constexpr float kSmallestHeadM = 0.05f, kLargestHeadM = 0.2f;
  const float radius = covered_head_radius(groom), radius_m = radius * unit_m;
  if (radius == 0.0f || (radius_m >= kSmallestHeadM && radius_m <= kLargestHeadM)) return {};
  return fmt::format(
      "with its unit the head under this hair has a radius of {}, as nobody's: groom.file.unit_m={:.4g} "
      "makes it {}",
      unit_text(radius_m), guess_unit(groom).value, unit_text(radius * guess_unit(groom).value));
}

/// What to say of a unit with which no head has this hair; empty where one might. `size`: in file units.
std::string unlikely_unit(float unit_m, const glm::vec3& size) {
  constexpr float kSmallestHairM = 0.03f, kLargestHairM = 6.0f;
  const float largest = std::max({size.x, size.y, size.z});
  const auto is_likely = [largest](float metres) {
    return largest * metres >= kSmallestHairM && largest * metres <= kLargestHairM;
  };
  if (is_likely(unit_m) || !(largest > 0.0f)) return {};
  std::string sentence =
      fmt::format("with its unit this hair is {} long, as on no head", unit_text(largest * unit_m));
  for (const auto& [other_m, name] : kCommonUnits)
    if (is_likely(other_m))
      return sentence +
             fmt::format(": groom.file.unit_m={:g} makes it {}", other_m, unit_text(largest * other_m));
  return sentence;
}

/// What to say of a unit with which the roots reach further than those of a head and a mane down its back;
/// empty where they may.
std::string unlikely_roots(float unit_m, const Groom& groom) {
  constexpr float kLeastRootsM = 0.03f, kMostRootsM = 0.5f;
  constexpr double kFew = 0.05;  // stray ones say nothing
  constexpr uint32_t kLeastRoots = 64;
  if (groom.strand_count() < kLeastRoots || !is_hair_of_head(groom)) return {};
  const std::vector<glm::vec3> roots = roots_of(groom);
  float reach = 0.0f;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> places;
    for (const glm::vec3& root : roots) places.push_back(static_cast<double>(root[axis]));
    reach = std::max(reach, static_cast<float>(quantile(places, 1.0 - kFew) - quantile(places, kFew)));
  }
  if (!(reach * unit_m > kMostRootsM)) return {};
  std::string sentence =
      fmt::format("the roots reach over {} then, as on no head", unit_text(reach * unit_m));
  for (const auto& [other_m, name] : kCommonUnits)
    if (reach * other_m >= kLeastRootsM && reach * other_m <= kMostRootsM)
      return sentence +
             fmt::format(": groom.file.unit_m={:g} makes it {}", other_m, unit_text(reach * other_m));
  return sentence + ": groom.file.unit_m states another unit";
}

/// Vertices that a strand holds in a row from its root on, and up to its tip.
struct HeldEnds {
  size_t root = 0, tip = 0;
  bool operator==(const HeldEnds&) const = default;
};

HeldEnds held_ends(std::span<const uint8_t> pins) {
  const auto is_free = [](uint8_t pin) { return pin == 0; };
  return {static_cast<size_t>(std::find_if(pins.begin(), pins.end(), is_free) - pins.begin()),
          static_cast<size_t>(std::find_if(pins.rbegin(), pins.rend(), is_free) - pins.rbegin())};
}

/// A simulation pins all roots alike, as many vertices as most of them do, of equally many the fewer. A tip
/// is free or held: then by as many vertices as most held ones. Returns what to say of strands that pin
/// others, and of tips of both kinds.
std::vector<std::string> settle_pins(Groom& groom) {
  const size_t count = groom.vertex_count(0);
  const auto pins_of = [&](uint32_t strand) {
    return std::span(groom.pinned).subspan(groom.offset[strand], groom.vertex_count(strand));
  };
  std::vector<size_t> roots(count + 1), tips(count + 1);  // strands that hold so many
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    const HeldEnds ends = held_ends(pins_of(strand));
    ++roots[ends.root];
    ++tips[ends.tip];
  }
  const auto most = [](std::span<const size_t> strands) {
    return static_cast<size_t>(std::max_element(strands.begin(), strands.end()) - strands.begin());
  };
  const size_t free_count = tips[0];
  tips[0] = 0;
  HeldEnds held{most(roots), most(tips)};
  // Where nothing would be left to move beside strands that do, no tip is held.
  if (free_count > 0 && held.root + held.tip >= count) held.tip = 0;
  size_t changed = 0, tied = 0;
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    const auto pins = pins_of(strand);
    const size_t tip = held_ends(pins).tip > 0 ? held.tip : 0;
    bool is_other = false;
    for (size_t i = 0; i < count; ++i) {
      const uint8_t pin = i < held.root || i + tip >= count ? 1 : 0;
      is_other = is_other || pin != pins[i];
      pins[i] = pin;
    }
    changed += is_other ? 1 : 0;
    tied += tip > 0 ? 1 : 0;
  }
  std::vector<std::string> said;
  if (held.root + held.tip >= count)
    said.push_back(
        "the file holds every vertex: nothing of this hair moves (groom.file.pinning=ROOT lets go of it)");
  if (changed > 0)
    said.push_back(
        fmt::format("{} of {} strands hold other vertices than most: {} at the root and {} at held "
                    "tips are held now (groom.file.pinning states it)",
                    changed, groom.strand_count(), held.root, held.tip));
  if (tied > 0 && tied < groom.strand_count())
    said.push_back(fmt::format("the tips of {} of {} strands are held, the others are free", tied,
                               groom.strand_count()));
  return said;
}

/// What strands can be made of; the rest is left out and named.
HairMaterial usable_material(HairMaterial material, std::vector<std::string>& notes) {
  std::string taken;
  const auto judge = [&](std::optional<double>& value, double least, double most, const char* what) {
    if (!value) return;
    const bool is_usable = *value >= least && *value <= most;
    if (is_usable)
      taken += fmt::format("{}{} {:.4g}", taken.empty() ? "" : ", ", what, *value);
    else
      notes.push_back(
          fmt::format("its {} {:.4g} is left out: {:g} to {:g} can be", what, *value, least, most));
    if (!is_usable) value.reset();
  };
  judge(material.diameter, 2e-6, 2e-2, "diameter in m");
  judge(material.young_modulus, 0.0, 1e16, "Young's modulus in Pa");
  judge(material.density, 1.0, 1e5, "density in kg/m^3");
  judge(material.poisson_ratio, -0.9, 0.5, "Poisson's ratio");
  if (!taken.empty())
    notes.push_back(
        fmt::format("it is made of: {} (direct_rod takes it; solver.parameters overrides it)", taken));
  return material;
}

std::string size_text(const Groom& groom) {
  const glm::vec3 size_m = box_size_of(groom.rest_position_m);
  return fmt::format("{:.2f} x {:.2f} x {:.2f} m", size_m.x, size_m.y, size_m.z);
}

/// What to say of hair whose side that is up is another than the one that is taken, which the file states or
/// nothing does; empty where it may be right.
std::string unlikely_side(const Groom& groom, const UpSide& taken, bool is_stated) {
  const Guess<UpSide> guess = is_stated ? guess_up(groom, taken) : Guess<UpSide>{taken, {}};
  if (!guess.reason.empty())
    return fmt::format(
        "{} of the file is up by what it says, but {} by its hair, which covers that side: "
        "groom.file.up_axis={} turns it up",
        name_of(taken), name_of(guess.value), setting_of(guess.value));
  const char* const side = lies_aside(groom, taken);
  if (side == nullptr) return {};
  return fmt::format(
      "the hair covers {} of the file and hangs from it, and no setting turns that side up: turn "
      "it where it was made",
      side);
}

void note_guess(PlacedGroom& placed, const std::string& what, const std::string& reason,
                const char* setting) {
  placed.notes.push_back(fmt::format("{}: {} (groom.file.{} states it)", what, reason, setting));
}

/// Turns a groom upright, +Y up.
void turn_up(StatedGroom& stated, const GroomFileOptions& options, PlacedGroom& placed) {
  GroomPlacement upright;
  if (options.is_z_up) {
    upright.is_z_up = *options.is_z_up;
    upright.is_upside_down = options.is_upside_down;
  } else if (stated.is_z_up) {
    upright.is_z_up = *stated.is_z_up;
    placed.notes.push_back(fmt::format("+{} of the file is up: {} (groom.file.up_axis overrides it)",
                                       *stated.is_z_up ? 'Z' : 'Y', stated.up_axis_reason));
  } else {
    const Guess<UpSide> guess = guess_up(stated.groom);
    upright.is_z_up = guess.value.is_z_up;
    upright.is_upside_down = guess.value.is_upside_down;
    note_guess(placed, fmt::format("{} of the file is up", name_of(guess.value)),
               guess.reason.empty() ? "the hair speaks for no other side" : guess.reason, "up_axis");
  }
  if (!options.is_z_up) {
    const UpSide side{upright.is_z_up, upright.is_upside_down};
    add_sentence(placed.unlikely, unlikely_side(stated.groom, side, stated.is_z_up.has_value()));
  }
  for (glm::vec3& point : stated.groom.rest_position_m) point = upright.place(point);
  placed.placement.is_z_up = upright.is_z_up;
  placed.placement.is_upside_down = upright.is_upside_down;
}

/// Finds the face of an upright groom.
void turn_ahead(const Groom& groom, const GroomFileOptions& options, PlacedGroom& placed) {
  GroomPlacement& placement = placed.placement;
  if (options.yaw_deg) {
    placement.yaw_deg = *options.yaw_deg;
  } else {
    const Guess<float> guess = guess_yaw_deg(groom);
    placement.yaw_deg = guess.value;
    if (guess.reason.empty()) {
      note_guess(placed, "the face is taken to be at +Z", "the hairline is as high all around", "yaw_deg");
    } else if (guess.value == 0.0f) {
      note_guess(placed, "it faces +Z", guess.reason, "yaw_deg");
    } else {
      note_guess(placed, fmt::format("turned by {} degrees to face +Z", guess.value), guess.reason,
                 "yaw_deg");
    }
  }
}

/// What becomes the origin where nobody states it: of a character far away on its stage the middle of the
/// roots. Hair that is far for its unit is left there.
glm::vec3 find_origin(const Groom& groom, PlacedGroom& placed) {
  constexpr double kFarM = 50.0;
  glm::dvec3 middle(0.0);
  for (const glm::vec3& root : roots_of(groom))
    middle += glm::dvec3(root) / static_cast<double>(groom.strand_count());
  const double away_m = glm::length(middle) * static_cast<double>(placed.placement.unit_m);
  if (!placed.unlikely.empty() || !(away_m > kFarM) || !std::isfinite(away_m)) return glm::vec3(0.0f);
  placed.notes.push_back(
      fmt::format("it stands {:.4g} m from the origin, and is brought here (groom.file.origin states where "
                  "the head's joint is)",
                  away_m));
  return glm::vec3(middle);
}

/// Turns, moves and scales a groom in file units. What the options do not say the file may; the rest is
/// guessed.
PlacedGroom place(StatedGroom stated, const GroomFileOptions& options) {
  PlacedGroom placed;
  placed.notes = std::move(stated.notes);
  turn_up(stated, options, placed);
  turn_ahead(stated.groom, options, placed);
  Groom& groom = stated.groom;
  GroomPlacement& placement = placed.placement;
  const auto judge_unit = [&](float unit_m) {
    std::string unlikely = unlikely_unit(unit_m, box_size_of(groom.rest_position_m));
    // What is guessed is so from that head.
    const bool is_stated = options.unit_m > 0.0f || stated.unit_m;
    if (unlikely.empty() && is_stated) unlikely = unlikely_head(unit_m, groom);
    if (unlikely.empty()) unlikely = unlikely_roots(unit_m, groom);
    add_sentence(placed.unlikely, unlikely);
  };
  if (options.unit_m > 0.0f) {
    placement.unit_m = options.unit_m;
    judge_unit(options.unit_m);
  } else if (stated.unit_m) {
    placement.unit_m = *stated.unit_m;
    placed.notes.push_back(fmt::format("1 unit = {}: {} (groom.file.unit_m overrides it)",
                                       unit_text(*stated.unit_m), stated.unit_reason));
    judge_unit(*stated.unit_m);
  } else {
    const Guess<float> guess = guess_unit(groom);
    placement.unit_m = guess.value;
    note_guess(placed, fmt::format("1 unit = {}", unit_text(guess.value)),
               guess.reason.empty() ? "these roots say nothing of a head" : guess.reason, "unit_m");
    judge_unit(guess.value);
  }
  placed.material = usable_material(stated.material.scaled(placement.unit_m), placed.notes);
  const HairPlace hair = hair_place(groom);
  placed.is_of_head = hair == HairPlace::Head;
  if (hair == HairPlace::Jaw)
    placed.notes.emplace_back("it is taken as a beard: its roots lie below the middle of a face");
  else if (hair == HairPlace::Head && is_piece(groom))
    placed.notes.emplace_back("it is taken as brows or a part of hair: its roots lie on one side of a head");
  placement.origin = options.origin ? *options.origin : find_origin(groom, placed);
  GroomPlacement rest = placement;  // upright by now
  rest.is_z_up = rest.is_upside_down = false;
  for (glm::vec3& point : groom.rest_position_m) point = rest.place(point);
  groom.file_unit_m = placement.unit_m;
  placed.labels = std::move(stated.labels);
  for (float& width : placed.labels.width) width *= placement.unit_m;
  placed.groom = std::move(groom);
  return placed;
}

}  // namespace

float guess_unit_m(const Groom& groom) {
  return guess_unit(groom).value;
}

Result<PlacedGroom> load_placed_groom(const GroomFileOptions& options) {
  const std::string place_name = options.path.string();
  if (const Status checked = check_options(options); !checked) return at(place_name, checked.error());
  ASSIGN_OR_RETURN(JoinedParts loaded, load_parts(options));
  PlacedGroom placed = place(std::move(loaded.whole), options);
  add_sentence(placed.unlikely, loaded.apart);
  // Before resampling, so that overflown coordinates never enter its sums.
  if (const Status checked = validate(placed.groom); !checked)
    return at(place_name, placed.unlikely.empty() ? checked.error()
                                                  : make_error(ErrorCode::BadInput, "{}; {}",
                                                               checked.error().message, placed.unlikely));
  const uint32_t most = most_vertices(placed.groom);
  const uint32_t vertex_count = target_vertex_count(most, options.vertex_count);
  if (most > vertex_count && options.vertex_count == 0)
    placed.notes.push_back(fmt::format(
        "strands of up to {} points are resampled to {} each, the most that are simulated, evenly "
        "along their length",
        most, vertex_count));
  if (placed.groom.uniform_vertex_count() != vertex_count) {
    placed.labels.width = resample(placed.groom, placed.labels.width, vertex_count);
    placed.groom = resample(placed.groom, vertex_count);
  }
  if (options.pinning) placed.groom = with_pinning(std::move(placed.groom), *options.pinning);
  for (std::string& note : settle_pins(placed.groom)) placed.notes.push_back(std::move(note));
  placed.notes.push_back(fmt::format("{} strands x {} vertices, {}", placed.groom.strand_count(),
                                     placed.groom.uniform_vertex_count(), size_text(placed.groom)));
  return placed;
}

Result<Groom> load_groom(const GroomFileOptions& options) {
  ASSIGN_OR_RETURN(PlacedGroom placed, load_placed_groom(options));
  return std::move(placed.groom);
}

}  // namespace strandcast
