#include "common/scene/scene_file.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "common/base/check.h"
#include "common/base/file.h"
#include "common/base/text.h"
#include "common/scene/scene_fields.h"
#include "common/scene/scene_override.h"
#include "common/scene/text_errors_private.h"
#include "strandcast/v1/scene.pb.h"

namespace strandcast {
namespace {

namespace pb = google::protobuf;
using scene_fields::Range;

constexpr int kMaxNesting = 16;         // scene.proto nests four deep
constexpr size_t kMaxShownChars = 200;  // of an assignment, in error messages

const pb::FieldDescriptor& field_of(const pb::Message& message, const char* name) {
  const auto* field = message.GetDescriptor()->FindFieldByName(name);
  CHECK(field != nullptr);
  return *field;
}

/// Where values came from, for error messages.
struct Source {
  std::string place;
  const std::vector<std::string>* overrides = nullptr;
};

/// Copies a parsed message into a SceneDesc and checks every value that was given; keeps the first error.
class Reader {
 public:
  Reader(const pb::Message& message, const pb::TextFormat::ParseInfoTree* tree, Source source)
      : message_(&message), tree_(tree), source_(std::move(source)) {}

  Status status() const { return error_ ? Status(*error_) : Status(); }

  bool chooses(const char* name, bool) { return has(name); }

  template <class T>
  void number(const char* name, T& value, const Range& range) {
    const auto& field = field_of(*message_, name);
    if (!has(name)) return;
    value = get<T>(field);
    const bool in_range = value >= static_cast<T>(range.minimum) && value <= static_cast<T>(range.maximum);
    if (!std::isfinite(static_cast<double>(value)) || !in_range)
      fail(name, fmt::format("is {}, it must be within {:g} .. {:g}{}{}", value, range.minimum, range.maximum,
                             *range.unit ? " " : "", range.unit));
  }
  void flag(const char* name, bool& value) {
    const auto& field = field_of(*message_, name);
    if (has(name)) value = message_->GetReflection()->GetBool(*message_, &field);
  }
  template <class Enum>
  void choice(const char* name, Enum& value, Enum last) {
    const auto& field = field_of(*message_, name);
    if (!has(name)) return;
    const int given = message_->GetReflection()->GetEnumValue(*message_, &field);
    if (given < 0 || given > static_cast<int>(last))
      return fail(name, fmt::format("is {}, which is not one of its values", given));
    value = static_cast<Enum>(given);
  }
  void text(const char* name, std::string& value, size_t limit_bytes) {
    const auto& field = field_of(*message_, name);
    if (!has(name)) return;
    const std::string given = message_->GetReflection()->GetString(*message_, &field);
    if (given.empty() || given.size() > limit_bytes || !is_printable(given))
      return fail(name, fmt::format("must be 1 .. {} bytes of printable text", limit_bytes));
    value = given;
  }
  void path(const char* name, std::filesystem::path& value) {
    const auto& field = field_of(*message_, name);
    if (!has(name)) return;
    check_path(name, message_->GetReflection()->GetString(*message_, &field), value);
  }
  void paths(const char* name, std::vector<std::filesystem::path>& values, size_t limit) {
    const auto& field = field_of(*message_, name);
    const int size = message_->GetReflection()->FieldSize(*message_, &field);
    if (static_cast<size_t>(size) > limit)
      return fail(name, fmt::format("has {} entries, the limit is {}", size, limit));
    values.assign(static_cast<size_t>(size), {});
    for (int i = 0; i < size; ++i) {
      const std::string given = message_->GetReflection()->GetRepeatedString(*message_, &field, i);
      if (given.empty()) return fail(name, "has an empty entry: name the file");
      check_path(name, given, values[static_cast<size_t>(i)]);
    }
  }
  template <class Vector>
  void vector(const char* name, Vector& value, const Range& range) {
    components(name, value, range, {"x", "y", "z"});
  }
  void color(const char* name, glm::vec3& value, const Range& range) {
    components(name, value, range, {"r", "g", "b"});
  }
  void map(const char* name, std::map<std::string, double>& value, const Range&, size_t limit) {
    const auto& field = field_of(*message_, name);
    const auto* reflection = message_->GetReflection();
    const int size = reflection->FieldSize(*message_, &field);
    for (int i = 0; i < size; ++i) {
      const auto& entry = reflection->GetRepeatedMessage(*message_, &field, i);
      const std::string key = entry.GetReflection()->GetString(entry, field.message_type()->map_key());
      const double number = entry.GetReflection()->GetDouble(entry, field.message_type()->map_value());
      if (key.empty() || key.size() > scene_fields::kMaxNameBytes || !is_printable(key))
        return fail(name, "has a name that is empty, too long or not printable");
      if (!std::isfinite(number))
        return fail(name, fmt::format("gives {} the value {}, which is not finite", key, number));
      value[key] = number;
    }
    if (value.size() > limit) fail(name, fmt::format("has {} entries, the limit is {}", value.size(), limit));
  }
  template <class Body>
  void group(const char* name, Body body) {
    const auto& field = field_of(*message_, name);
    descend(name, message_->GetReflection()->GetMessage(*message_, &field), field, -1, body);
  }
  template <class T, class Body>
  void repeated(const char* name, std::vector<T>& values, size_t limit, Body body) {
    const auto& field = field_of(*message_, name);
    const int size = message_->GetReflection()->FieldSize(*message_, &field);
    if (static_cast<size_t>(size) > limit)
      return fail(name, fmt::format("has {} entries, the limit is {}", size, limit));
    values.assign(static_cast<size_t>(size), T{});
    for (int i = 0; i < size; ++i)
      descend(fmt::format("{}.{}", name, i),
              message_->GetReflection()->GetRepeatedMessage(*message_, &field, i), field, i,
              [&] { body(values[static_cast<size_t>(i)]); });
  }
  void require(const char* name, bool holds, const std::string& sentence) {
    if (!holds) fail(name, sentence);
  }

 private:
  bool has(const char* name) const {
    return message_->GetReflection()->HasField(*message_, &field_of(*message_, name));
  }

  void check_path(const char* name, const std::string& given, std::filesystem::path& value) {
    if (given.size() > scene_fields::kMaxPathBytes || !is_printable(given))
      return fail(name,
                  fmt::format("must be at most {} bytes of printable text", scene_fields::kMaxPathBytes));
    value = given;
  }

  template <class T>
  T get(const pb::FieldDescriptor& field) const {
    const auto* reflection = message_->GetReflection();
    switch (field.cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_DOUBLE:
        return static_cast<T>(reflection->GetDouble(*message_, &field));
      case pb::FieldDescriptor::CPPTYPE_FLOAT:
        return static_cast<T>(reflection->GetFloat(*message_, &field));
      default:
        return static_cast<T>(reflection->GetUInt32(*message_, &field));
    }
  }

  template <class Vector>
  void components(const char* name, Vector& value, const Range& range,
                  const std::array<const char*, 3>& names) {
    group(name, [&] {
      for (int i = 0; i < 3; ++i) number(names[static_cast<size_t>(i)], value[i], range);
    });
  }

  template <class Body>
  void descend(const std::string& name, const pb::Message& inner, const pb::FieldDescriptor& field, int index,
               Body body) {
    const auto* outer_message = message_;
    const auto* outer_tree = tree_;
    const std::string outer_path = path_;
    message_ = &inner;
    tree_ = tree_ ? tree_->GetTreeForNested(&field, index) : nullptr;
    path_ = path_.empty() ? name : fmt::format("{}.{}", path_, name);
    body();
    message_ = outer_message;
    tree_ = outer_tree;
    path_ = outer_path;
  }

  void fail(const char* name, const std::string& sentence) {
    if (error_) return;
    const std::string path = path_.empty() ? name : fmt::format("{}.{}", path_, name);
    error_ = at(place_of(name, path), make_error(ErrorCode::BadInput, "{} {}", path, sentence));
  }

  /// The override that set the field (or a part or the whole of it), else its line and column, else the file.
  std::string place_of(const char* name, const std::string& path) const {
    for (auto item = source_.overrides->rbegin(); item != source_.overrides->rend(); ++item) {
      const std::string set(override_path(*item));
      if (set == path || path.starts_with(set + '.') || set.starts_with(path + '.'))
        return "--set " + excerpt(*item, kMaxShownChars);
    }
    const auto& field = field_of(*message_, name);
    if (!tree_) return source_.place;
    const auto location = tree_->GetLocation(&field, field.is_repeated() ? 0 : -1);
    return location.line < 0 ? source_.place : place_at(source_.place, location.line, location.column);
  }

  const pb::Message* message_;
  const pb::TextFormat::ParseInfoTree* tree_;
  Source source_;
  std::string path_;
  std::optional<Error> error_;
};

/// The double with the fewest digits that rounds to the same float: 0.1f is written as 0.1.
template <class T>
double shortest(T value) {
  double result = static_cast<double>(value);
  if constexpr (std::is_same_v<T, float>) {
    const std::string digits = fmt::format("{}", value);
    std::from_chars(digits.data(), digits.data() + digits.size(), result);
  }
  return result;
}

/// Copies a SceneDesc into a message, every field.
class Writer {
 public:
  explicit Writer(pb::Message& message) : message_(&message) {}

  bool chooses(const char*, bool is_chosen) { return is_chosen; }

  template <class T>
  void number(const char* name, const T& value, const Range&) {
    const auto& field = field_of(*message_, name);
    const auto* reflection = message_->GetReflection();
    switch (field.cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_DOUBLE:
        return reflection->SetDouble(message_, &field, shortest(value));
      case pb::FieldDescriptor::CPPTYPE_FLOAT:
        return reflection->SetFloat(message_, &field, static_cast<float>(value));
      default:
        return reflection->SetUInt32(message_, &field, static_cast<uint32_t>(value));
    }
  }
  void flag(const char* name, bool value) {
    message_->GetReflection()->SetBool(message_, &field_of(*message_, name), value);
  }
  template <class Enum>
  void choice(const char* name, Enum value, Enum) {
    message_->GetReflection()->SetEnumValue(message_, &field_of(*message_, name), static_cast<int>(value));
  }
  void text(const char* name, const std::string& value, size_t) {
    message_->GetReflection()->SetString(message_, &field_of(*message_, name), value);
  }
  void path(const char* name, const std::filesystem::path& value) {
    if (!value.empty()) text(name, value.generic_string(), 0);
  }
  void paths(const char* name, const std::vector<std::filesystem::path>& values, size_t) {
    const auto& field = field_of(*message_, name);
    for (const std::filesystem::path& value : values)
      message_->GetReflection()->AddString(message_, &field, value.generic_string());
  }
  template <class Vector>
  void vector(const char* name, const Vector& value, const Range& range) {
    group(name, [&] {
      number("x", value.x, range);
      number("y", value.y, range);
      number("z", value.z, range);
    });
  }
  void color(const char* name, const glm::vec3& value, const Range& range) {
    group(name, [&] {
      number("r", value.r, range);
      number("g", value.g, range);
      number("b", value.b, range);
    });
  }
  void map(const char* name, const std::map<std::string, double>& value, const Range&, size_t) {
    const auto& field = field_of(*message_, name);
    for (const auto& [key, number] : value) {
      auto* entry = message_->GetReflection()->AddMessage(message_, &field);
      entry->GetReflection()->SetString(entry, field.message_type()->map_key(), key);
      entry->GetReflection()->SetDouble(entry, field.message_type()->map_value(), number);
    }
  }
  template <class Body>
  void group(const char* name, Body body) {
    descend(message_->GetReflection()->MutableMessage(message_, &field_of(*message_, name)), body);
  }
  template <class T, class Body>
  void repeated(const char* name, std::vector<T>& values, size_t, Body body) {
    for (T& value : values)
      descend(message_->GetReflection()->AddMessage(message_, &field_of(*message_, name)),
              [&] { body(value); });
  }
  void require(const char*, bool, const char*) {}

 private:
  template <class Body>
  void descend(pb::Message* inner, Body body) {
    pb::Message* const outer = std::exchange(message_, inner);
    body();
    message_ = outer;
  }

  pb::Message* message_;
};

v1::Scene to_message(const SceneDesc& scene) {
  v1::Scene message;
  SceneDesc copy = scene;  // the visitor is shared with the reader, which writes
  Writer writer(message);
  scene_fields::visit_scene(writer, copy);
  return message;
}

constexpr const char* kRodSolver = "direct_rod";

bool acts(const v1::Volume& volume) {
  return volume.friction_per_s() > 0.0 || volume.repulsion_per_s2() > 0.0 || volume.target_per_s2() > 0.0 ||
         volume.wind_width_m() > 0.0;
}

/// A groom from a file comes with a style, and keeps it: its shape carries all of its weight, unless the
/// scene of that file or an override says otherwise. What a scene says of grown hair is not said of a file's.
/// `place`: in front of the head's fields in overrides.
void keep_style(v1::Scene& message, bool had_file, const std::vector<std::string>& overrides,
                const std::string& place = {}) {
  constexpr const char* kSagFree = "sag_free";
  if (!message.groom().has_file()) return;
  const bool is_told = std::any_of(overrides.begin(), overrides.end(), [&](const std::string& given) {
    return given.starts_with(place + "solver.parameters.sag_free=");
  });
  auto& parameters = *message.mutable_solver()->mutable_parameters();
  if (is_told || (had_file && parameters.contains(kSagFree))) return;
  parameters[kSagFree] = 1.0;
}

// What hair on hair is in scenes of full quality (strandcast-report coherence shows what each does).
constexpr double kFullFrictionPerS = 20.0;
constexpr double kFullRepulsionPerS2 = 18'000.0;
// Hair that was thrown over other hair lies in it more densely than in the groom, and has to get back through
// it: what pushes at the groom's own density holds it where it was thrown.
constexpr double kFullRestDensity = 1.5;
// Cells as wide as a lock: finer ones cost more, and hair holds together less.
constexpr uint32_t kFullResolution = 16;
// Of fast quality, which has no air to brake its hair: a style as stiff as this, and no thrust from follower
// to leader, keep hair that walks and turns from being thrown over the parting.
constexpr std::pair<const char*, double> kFastParameters[] = {
    {"style_stiffness_per_s2", 600.0}, {"style_tip_share", 0.4}, {"thrust_share", 0.0}};
// Hair that is shaken needs steps no longer than this, whatever the scene's own are.
constexpr double kFullStepHz = 60.0;
constexpr double kMostFullSubsteps = 6.0;

void add_hair_in_air(v1::Scene& message) {
  message.mutable_volume()->set_friction_per_s(kFullFrictionPerS);
  message.mutable_volume()->set_repulsion_per_s2(kFullRepulsionPerS2);
  message.mutable_volume()->set_rest_density_scale(kFullRestDensity);
  message.mutable_volume()->set_resolution(kFullResolution);
  message.mutable_air()->set_acts(true);
}

/// What a quality stands for, in place of what the scene says of it.
void take_quality(v1::Scene& message) {
  const bool is_fast = message.quality() == kFastQuality;
  if (!is_fast && message.quality() != kFullQuality && message.quality() != kAutoQuality) return;
  v1::Solver& solver = *message.mutable_solver();
  solver.Clear();
  solver.set_name(is_fast ? "dftl" : kRodSolver);
  (*solver.mutable_parameters())["sag_free"] = 1.0;
  if (is_fast)
    for (const auto& [name, value] : kFastParameters) (*solver.mutable_parameters())[name] = value;
  message.clear_volume();
  message.clear_air();
  message.mutable_head()->set_collider(is_fast ? kSphereCollider : kFieldCollider);
  if (!is_fast) add_hair_in_air(message);
}

bool names_any(const std::vector<std::string>& overrides, std::initializer_list<std::string_view> paths) {
  return std::any_of(overrides.begin(), overrides.end(), [&](const std::string& given) {
    return std::any_of(paths.begin(), paths.end(),
                       [&](std::string_view path) { return given.starts_with(path); });
  });
}

/// Raises the substeps until their rate is about kFullStepHz, at most to kMostFullSubsteps. A rate that
/// is lower by a quarter of a substep is accepted.
void add_substeps(v1::Scene& message) {
  constexpr double kALittle = 0.25;
  const double rate_hz = message.has_step_rate_hz() ? message.step_rate_hz() : kFullStepHz;
  if (!(rate_hz > 0.0) || (message.has_substeps() && message.substeps() == 0)) return;
  const double count = std::clamp(std::ceil(kFullStepHz / rate_hz - kALittle), 1.0, kMostFullSubsteps);
  if (count > message.substeps()) message.set_substeps(static_cast<uint32_t>(count));
}

/// Those that full quality takes, where the scene has as many.
void drop_substeps(v1::Scene& message) {
  v1::Scene full = message;
  full.clear_substeps();
  add_substeps(full);
  if (full.has_substeps() && full.substeps() == message.substeps()) message.clear_substeps();
}

/// Quality, then overrides: whoever chooses a model by hand gets what the scene itself says, and whoever
/// changes what a quality stands for has one of his own. Rods that are chosen by hand act on each other, in
/// air, unless told otherwise.
Status apply_choices(v1::Scene& message, bool is_text, const std::vector<std::string>& overrides) {
  const bool names_solver = names_any(overrides, {"solver"});
  // A scene that runs brings the substeps that its quality took.
  const bool was_full = !is_text && message.solver().name() == kRodSolver &&
                        (message.quality() == kFullQuality || message.quality() == kAutoQuality);
  for (const std::string& assignment : overrides)
    if (assignment.starts_with("quality=")) RETURN_IF_ERROR(apply_override(message, assignment));
  const bool names_quality = names_any(overrides, {"quality="});
  const bool says_nothing =
      !message.has_solver() && !message.has_volume() && !message.has_air() && !message.head().has_collider();
  if (is_text && !message.has_quality() && says_nothing) message.set_quality(kAutoQuality);
  const bool takes_quality = !names_solver && (names_quality || (is_text && message.has_quality()));
  if (takes_quality) take_quality(message);
  const bool is_full =
      takes_quality && !names_any(overrides, {"substeps="}) && message.solver().name() == kRodSolver;
  const bool is_rod_before = message.solver().name() == kRodSolver;
  if (was_full && takes_quality && !is_rod_before) drop_substeps(message);
  for (const std::string& assignment : overrides) RETURN_IF_ERROR(apply_override(message, assignment));
  if (names_solver || names_any(overrides, {"volume.", "air.", "head.collider"}))
    message.set_quality(kCustomQuality);
  const bool is_chosen = is_text ? !message.has_volume() && !message.has_air()
                                 : !is_rod_before && !acts(message.volume()) && !message.air().acts();
  const bool is_told = names_any(overrides, {"volume.", "air."});
  if (message.solver().name() == kRodSolver && is_chosen && !is_told) add_hair_in_air(message);
  if (is_full) add_substeps(message);
  return {};
}

/// What a further head inherits of its scene: all but what is the scene's own head's. What holds of some hair
/// or some mesh alone, and lists, a head states whole or not at all.
v1::Scene inherited(const v1::Scene& scene, const v1::Scene& head) {
  v1::Scene all = scene;
  all.clear_heads();
  all.clear_name();
  all.clear_live();
  all.clear_place_m();
  if (head.has_groom()) all.clear_groom();
  if (head.has_target_groom()) all.clear_target_groom();
  if (head.has_head()) all.clear_head();
  if (head.has_solver()) all.clear_solver();
  if (head.has_body()) all.clear_body();
  if (head.colliders_size() > 0) all.clear_colliders();
  return all;
}

/// Makes a whole scene of each further head. `had_file`: the scene had a groom file before the overrides.
Status complete_heads(v1::Scene& scene, bool had_file, const std::string& place,
                      const std::vector<std::string>& overrides) {
  if (scene.heads_size() >= static_cast<int>(kMaxHeads)) return {};  // the reader says so
  for (int i = 0; i < scene.heads_size(); ++i) {
    v1::Scene& head = *scene.mutable_heads(i);
    if (head.heads_size() > 0)
      return at(place, make_error(ErrorCode::BadInput,
                                  "heads.{0}.heads: a further head has none itself, list all in heads", i));
    const bool has_file = head.has_groom() ? head.groom().has_file() : had_file;
    v1::Scene whole = inherited(scene, head);
    if (head.has_quality()) take_quality(head);
    if (head.has_solver() && !head.has_quality()) head.set_quality(kCustomQuality);
    whole.MergeFrom(head);
    head = std::move(whole);
    keep_style(head, has_file, overrides, fmt::format("heads.{}.", i));
  }
  return {};
}

Result<SceneDesc> from_message(v1::Scene& message, const pb::TextFormat::ParseInfoTree* tree,
                               const std::string& place, const std::vector<std::string>& overrides) {
  const bool had_file = message.groom().has_file();
  RETURN_IF_ERROR(apply_choices(message, tree != nullptr, overrides));
  RETURN_IF_ERROR(complete_heads(message, had_file, place, overrides));
  keep_style(message, had_file, overrides);
  Reader reader(message, tree, {place, &overrides});
  SceneDesc scene;
  scene_fields::visit_scene(reader, scene);
  RETURN_IF_ERROR(reader.status());
  return scene;
}

void resolve(std::string& path, const std::filesystem::path& folder) {
  if (!path.empty()) path = (folder / path).lexically_normal().generic_string();
}

void resolve(v1::Groom& groom, const std::filesystem::path& folder) {
  if (!groom.has_file()) return;
  if (groom.file().has_path()) resolve(*groom.mutable_file()->mutable_path(), folder);
  for (std::string& path : *groom.mutable_file()->mutable_more_paths()) resolve(path, folder);
}

void resolve(v1::Scene& scene, const std::filesystem::path& folder) {
  if (scene.has_groom()) resolve(*scene.mutable_groom(), folder);
  if (scene.has_target_groom()) resolve(*scene.mutable_target_groom(), folder);
  if (scene.head().has_mesh_path()) resolve(*scene.mutable_head()->mutable_mesh_path(), folder);
  if (scene.has_head())
    for (std::string& path : *scene.mutable_head()->mutable_more_mesh_paths()) resolve(path, folder);
  for (v1::Scene& head : *scene.mutable_heads()) resolve(head, folder);
}

Result<SceneDesc> parse(const std::string& text, const std::string& place,
                        const std::filesystem::path& folder, const std::vector<std::string>& overrides) {
  if (text.size() > kMaxSceneFileBytes)
    return at(place, make_error(ErrorCode::LimitExceeded, "the scene has {} bytes, the limit is {}",
                                text.size(), kMaxSceneFileBytes));
  v1::Scene message;
  TextErrors errors;
  pb::TextFormat::ParseInfoTree tree;
  pb::TextFormat::Parser parser;
  parser.RecordErrorsTo(&errors);
  parser.WriteLocationsTo(&tree);
  parser.SetRecursionLimit(kMaxNesting);
  if (!parser.ParseFromString(text, &message)) return errors.error(place);
  // Before the overrides: a path typed on the command line starts at the current folder, as everywhere else.
  resolve(message, folder);
  return from_message(message, &tree, place, overrides);
}

}  // namespace

Result<SceneDesc> load_scene(const std::filesystem::path& path, const std::vector<std::string>& overrides) {
  ASSIGN_OR_RETURN(const std::string text, load_text(path, kMaxSceneFileBytes));
  return parse(text, path.string(), path.parent_path(), overrides);
}

Result<SceneDesc> parse_scene(const std::string& text, const std::string& place,
                              const std::vector<std::string>& overrides) {
  return parse(text, place, {}, overrides);
}

Result<SceneDesc> parse_recorded_scene(const std::string& text, const std::string& place) {
  ASSIGN_OR_RETURN(const SceneDesc chosen, parse_scene(text, place, {}));
  ASSIGN_OR_RETURN(SceneDesc scene, parse_scene(text, place, {std::string("quality=") + kCustomQuality}));
  scene.quality = chosen.quality;
  return scene;
}

Result<SceneDesc> with_overrides(const SceneDesc& scene, const std::vector<std::string>& overrides) {
  v1::Scene message = to_message(scene);
  return from_message(message, nullptr, "scene " + scene.name, overrides);
}

Result<SceneDesc> built_in_scene_with(const std::vector<std::string>& overrides) {
  return with_overrides(built_in_scene(), overrides);
}

std::string to_text(const SceneDesc& scene) {
  std::string text;
  CHECK(pb::TextFormat::PrintToString(to_message(scene), &text));
  return text;
}

SceneDesc with_absolute_paths(SceneDesc scene) {
  const auto complete = [](std::filesystem::path& path) {
    std::error_code failure;
    if (path.empty()) return;
    const std::filesystem::path absolute = std::filesystem::absolute(path, failure);
    if (!failure) path = absolute.lexically_normal();
  };
  complete(scene.head.mesh_path);
  for (std::filesystem::path& path : scene.head.more_mesh_paths) complete(path);
  const auto complete_groom = [&](GroomDesc& groom) {
    auto* const file = std::get_if<FileGroomDesc>(&groom);
    if (file == nullptr) return;
    complete(file->path);
    for (std::filesystem::path& path : file->more_paths) complete(path);
  };
  complete_groom(scene.groom);
  if (scene.target_groom) complete_groom(*scene.target_groom);
  for (SceneDesc& head : scene.heads) head = with_absolute_paths(std::move(head));
  return scene;
}

std::string to_line(const SceneDesc& scene) {
  std::string text;
  pb::TextFormat::Printer printer;
  printer.SetSingleLineMode(true);
  CHECK(printer.PrintToString(to_message(scene), &text));
  return text;
}

std::string to_text(const LookDesc& look, const CameraDesc& camera) {
  SceneDesc scene;
  scene.look = look;
  scene.camera = camera;
  const v1::Scene whole = to_message(scene);
  v1::Scene part;
  *part.mutable_look() = whole.look();
  *part.mutable_camera() = whole.camera();
  std::string text;
  CHECK(pb::TextFormat::PrintToString(part, &text));
  return text;
}

}  // namespace strandcast
