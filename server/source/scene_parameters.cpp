#include "server/source/scene_parameters.h"

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

#include "common/base/text.h"
#include "common/scene/scene_fields.h"
#include "server/sim/solver_registry.h"
#include "server/source/scene_change.h"

namespace strandcast {
namespace {

using scene_fields::Range;

bool is_live(const std::string& path) {
  const std::vector<std::string>& fields = live_fields();
  return std::any_of(fields.begin(), fields.end(), [&](const std::string& field) {
    return path == field || path.starts_with(field + ".");
  });
}

/// Fit for a message: printable, and of so many bytes at most.
std::string cut(const std::string& text, size_t limit_bytes) {
  std::string clean = printable(text, limit_bytes);
  size_t size = 0;
  while (size < clean.size()) {
    const size_t length = std::max<size_t>(utf8_length(clean, size), 1);
    if (size + length > limit_bytes) break;
    size += length;
  }
  clean.resize(size);
  return clean;
}

std::string text_of(double value) {
  return fmt::format("{}", value);
}
/// The fewest digits that lead to the same float.
std::string text_of(float value) {
  return fmt::format("{}", value);
}
std::string text_of(uint32_t value) {
  return fmt::format("{}", value);
}

/// Walks the fields of a scene and notes each.
class Lister {
 public:
  bool chooses(const char*, bool is_chosen) { return is_chosen; }

  template <class T>
  void number(const char* name, const T& value, const Range& range) {
    ParameterInfo& info = add(name, text_of(value));
    info.unit = range.unit;
    info.has_range = true;
    info.minimum = range.minimum;
    info.maximum = range.maximum;
  }
  void flag(const char* name, bool value) { add(name, value ? "true" : "false").note = "true or false"; }
  template <class Enum>
  void choice(const char* name, Enum value, Enum) {
    add(name, text_of(static_cast<uint32_t>(value)));
  }
  void text(const char* name, const std::string& value, size_t) { add(name, value); }
  void path(const char* name, const std::filesystem::path& value) { add(name, value.generic_string()); }
  void paths(const char* name, const std::vector<std::filesystem::path>& values, size_t) {
    for (size_t i = 0; i < values.size(); ++i) add(fmt::format("{}.{}", name, i), values[i].generic_string());
  }
  template <class Vector>
  void vector(const char* name, const Vector& value, const Range& range) {
    whole(name, fmt::format("{{ x: {} y: {} z: {} }}", value.x, value.y, value.z), range);
  }
  void color(const char* name, const glm::vec3& value, const Range& range) {
    whole(name, fmt::format("{{ r: {} g: {} b: {} }}", value.x, value.y, value.z), range);
  }
  /// The solver's: those that it takes are listed by its row.
  void map(const char*, const std::map<std::string, double>& values, const Range&, size_t) {
    solver_parameters_ = &values;
  }
  template <class Body>
  void group(const char* name, Body body) {
    const std::string outer = std::exchange(group_, fmt::format("{}{}.", group_, name));
    body();
    if (group_ == "solver.") add_solver();
    group_ = outer;
  }
  template <class T, class Body>
  void repeated(const char* name, std::vector<T>& values, size_t, Body body) {
    for (size_t i = 0; i < values.size(); ++i)
      group(fmt::format("{}.{}", name, i).c_str(), [&] { body(values[i]); });
  }
  /// Says of names what is known.
  void require(const char* name, bool, std::string_view sentence) {
    constexpr std::string_view kUnknown = "is unknown (";
    const std::string path = group_ + name;
    const auto found = std::find_if(list_.rbegin(), list_.rend(),
                                    [&](const ParameterInfo& info) { return info.path == path; });
    if (found == list_.rend() || !sentence.starts_with(kUnknown)) return;
    found->note = cut(std::string(sentence.substr(kUnknown.size(), sentence.size() - kUnknown.size() - 1)),
                      kMaxParameterTextBytes);
  }

  std::vector<ParameterInfo> take() { return std::move(list_); }

 private:
  ParameterInfo& add(const std::string& name, const std::string& value) {
    ParameterInfo info;
    info.path = group_ + name;
    info.value = cut(value, kMaxParameterTextBytes);
    info.is_live = is_live(info.path);
    list_.push_back(std::move(info));
    return list_.back();
  }
  void whole(const char* name, const std::string& value, const Range& range) {
    ParameterInfo& info = add(name, value);
    info.unit = range.unit;
    info.has_range = true;
    info.minimum = range.minimum;
    info.maximum = range.maximum;
  }
  void add_solver() {
    const std::string solver = list_.back().value;  // its name, the field before
    const auto row = find_solver(solver);
    if (!row || solver_parameters_ == nullptr) return;
    for (const SolverParameterInfo& parameter : (*row)->parameters) {
      const auto given = solver_parameters_->find(parameter.name);
      ParameterInfo& info =
          add("parameters." + parameter.name,
              text_of(given != solver_parameters_->end() ? given->second : parameter.default_value));
      info.unset_value = text_of(parameter.default_value);
      info.unit = parameter.unit;
      info.has_range = true;
      info.minimum = parameter.minimum;
      info.maximum = parameter.maximum;
      info.note = cut(parameter.summary, kMaxParameterTextBytes);
    }
  }

  std::string group_;  // with a dot behind it
  const std::map<std::string, double>* solver_parameters_ = nullptr;
  std::vector<ParameterInfo> list_;
};

std::vector<ParameterInfo> walk(SceneDesc scene) {
  Lister lister;
  scene_fields::visit_scene(lister, scene);
  return lister.take();
}

/// Returns the note shown beside a parameter. That of `quality` says which quality runs, that of friction
/// why it has no effect.
std::string control_note(const ParameterInfo& info, const SceneDesc& scene,
                         const std::string& quality_reason) {
  const std::string why = quality_reason.empty() ? std::string() : ", as " + quality_reason;
  if (info.path == "quality" && (scene.quality == kAutoQuality || !why.empty()))
    return cut(
        fmt::format("{}; {} runs{}", info.note, scene.volume.acts() ? kFullQuality : kFastQuality, why),
        kMaxParameterTextBytes);
  if (info.path == "hair.friction" && scene.volume.friction_per_s == 0.0)
    return "rests: hair does not act on hair here, quality full lets it";
  for (const HairControl& control : kHairControls)
    if (info.path == std::string("hair.") + control.name) return control.note;
  return info.note;
}

}  // namespace

std::vector<ParameterInfo> list_parameters(const SceneDesc& scene, const std::string& quality_reason) {
  static const std::map<std::string, std::string> kUnset = [] {
    std::map<std::string, std::string> values;
    for (const ParameterInfo& info : walk(SceneDesc())) values.emplace(info.path, info.value);
    values["quality"] = kAutoQuality;  // of a scene that says nothing of it
    return values;
  }();
  std::vector<ParameterInfo> parameters = walk(scene);
  for (ParameterInfo& info : parameters) {
    info.note = control_note(info, scene, quality_reason);
    if (!info.unset_value.empty()) continue;
    if (const auto found = kUnset.find(info.path); found != kUnset.end()) info.unset_value = found->second;
  }
  std::erase_if(parameters,
                [](const ParameterInfo& info) { return info.path.size() > kMaxParameterPathBytes; });
  return parameters;
}

bool begins_so(const std::string& path, const std::string& prefixes) {
  for (size_t begin = 0; begin <= prefixes.size();) {
    const size_t end = std::min(prefixes.find(',', begin), prefixes.size());
    if (path.starts_with(std::string_view(prefixes).substr(begin, end - begin))) return true;
    begin = end + 1;
  }
  return false;
}

ParameterList list_of(const std::vector<ParameterInfo>& parameters, const ParameterRequest& request) {
  ParameterList list;
  for (const ParameterInfo& info : parameters) {
    if (!begins_so(info.path, request.prefix)) continue;
    if (list.total++ < request.first || list.parameters.size() >= kMaxListedParameters) continue;
    list.parameters.push_back(info);
  }
  return list;
}

}  // namespace strandcast
