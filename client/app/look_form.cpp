#include "client/app/look_form.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include "common/base/check.h"
#include "common/base/units.h"
#include "common/scene/scene_fields.h"
#include "common/scene/scene_file.h"

namespace strandcast {
namespace {

using scene_fields::Range;

constexpr const char* kOwnColors = "custom";

/// How a field is shown where its name, its group and its range do not say it well.
struct Shown {
  std::string_view path;
  std::string_view section;
  std::string_view title;      // empty: the name's words
  double handy_maximum = 0.0;  // 0: the range's
  std::string_view help = {};
};

constexpr std::string_view kStyle = "Style";
constexpr std::string_view kShading = "Shading";
constexpr std::string_view kOther = "Other";
constexpr std::array<std::string_view, 6> kSections{"Colour", kStyle, kShading, "Light", "Detail", kOther};

// Between fields and what a person sees of them. A field without a row is shown by its name.
// schema begin: look form
// clang-format off
constexpr std::array kShown{
    Shown{"hair_color", "Colour", "hair colour", 0.0,
          "custom: root and tip colour; melanin: the two amounts; or a colour by name"},
    Shown{"root_color", "Colour", "root colour", 0.0, "of the hair colour custom"},
    Shown{"tip_color", "Colour", "tip colour", 0.0, "of the hair colour custom"},
    Shown{"eumelanin", "Colour", "brown melanin", 8.0,
          "of the hair colour melanin; 0.3 blond, 1.3 brown, 8 black"},
    Shown{"pheomelanin", "Colour", "red melanin", 4.0, "of the hair colour melanin"},
    Shown{"strand_radius_m", "Detail", "radius", 0.0005,
          "as drawn: a drawn strand stands for several real ones"},
    Shown{"tip_scale", "Detail", "radius at the tip", 0.0, "over that at the root"},
    Shown{"followers", "Detail", "", 0.0, "drawn strands between each three simulated ones"},
    Shown{"segments", "Detail", "", 0.0, "drawn between two simulated vertices"},
    Shown{"light_direction", "Light", "key from", 0.0,
          "about the head from the front, and above the horizon"},
    Shown{"light_color", "Light", "key colour", 4.0},
    Shown{"rim_direction", "Light", "rim from", 0.0, "about the head from the front, and above the horizon"},
    Shown{"rim_color", "Light", "rim colour", 4.0, "black: there is none"},
    Shown{"ambient", "Light", "", 0.0},
    Shown{"exposure", "Light", "", 4.0},
    Shown{"background", "Colour", "", 0.0},
    Shown{"skin_color", "Colour", "skin", 0.0},
    Shown{"style.clump", "Style", "", 0.0, "how far tips are drawn together into locks"},
    Shown{"style.locks", "Style", "", 0.0, "in each triangle of roots"},
    Shown{"style.spread", "Style", "", 0.1, "how far a tip strays from its lock, of a strand's length"},
    Shown{"style.wave_m", "Style", "waves", 0.02, "at the tip; a lock's strands share them"},
    Shown{"style.wave_count", "Style", "waves along it", 16.0},
    Shown{"style.frizz_m", "Style", "frizz", 0.005, "small waves, each strand's own"},
    Shown{"style.frizz_count", "Style", "frizz along it", 32.0},
    Shown{"style.stray_share", "Style", "strays", 0.3, "of all strands: they leave their lock"},
    Shown{"style.stray_spread", "Style", "strays go further", 10.0},
    Shown{"style.length_spread", "Style", "uneven lengths", 0.0},
    Shown{"style.short_share", "Style", "short ones", 0.5, "of all strands: broken off"},
    Shown{"style.tip_fade", "Style", "tips fade over", 0.0},
    Shown{"shading.diffuse", "Shading", "", 2.0},
    Shown{"shading.scatter", "Shading", "", 2.0, "light that comes through other strands"},
    Shown{"shading.highlight", "Shading", "", 4.0, "of the light's colour, from the surface"},
    Shown{"shading.transmission", "Shading", "", 4.0, "seen against the light"},
    Shown{"shading.second_highlight", "Shading", "", 4.0, "coloured, nearer to the root"},
    Shown{"shading.wetness", "Shading", "", 0.0, "0 dry, 1 dripping"},
};
// clang-format on
// schema end

const Shown* find_shown(std::string_view path) {
  const auto row =
      std::find_if(kShown.begin(), kShown.end(), [&](const Shown& one) { return one.path == path; });
  return row != kShown.end() ? &*row : nullptr;
}

/// Names that a field of text can have; none: any text.
std::vector<std::string> names_of(std::string_view path) {
  if (path == "hair_color") {
    std::vector<std::string> names{kOwnColors, "melanin"};
    for (const HairColorPreset& preset : hair_color_presets()) names.emplace_back(preset.name);
    return names;
  }
  const auto methods = [](const auto& table) {
    std::vector<std::string> names{kMainMethod};
    for (const MethodRow& row : table.rows()) names.emplace_back(row.name);
    return names;
  };
  if (path == "methods.shading") return methods(shading_models());
  if (path == "methods.scattering") return methods(scattering_models());
  if (path == "methods.evaluation") return methods(shading_places());
  if (path == "methods.shadow") return methods(shadow_methods());
  if (path == "methods.transparency") return methods(transparency_methods());
  if (path == "methods.antialiasing") return methods(antialiasing_methods());
  if (path == "methods.curve") return methods(curve_methods());
  if (path == "methods.joints") return methods(joint_methods());
  if (path == "methods.detail") return methods(detail_methods());
  if (path == "methods.culling") return methods(culling_methods());
  if (path == "methods.shadow_detail") return methods(shadow_details());
  return {};
}

/// A field that says nothing while another one has this value.
bool is_idle(const LookDesc& look, std::string_view path) {
  if (path == "root_color" || path == "tip_color") return look.hair_color != kOwnColors;
  if (path == "eumelanin" || path == "pheomelanin") return look.hair_color != "melanin";
  if (look.methods != RenderMethodsDesc{} && !is_drawn_by_methods(path)) return true;
  if (path == "rim_direction") return look.rim_color == glm::vec3(0.0f);
  return false;
}

/// "wave_m" is "wave": the unit stands behind the number.
std::string words_of(std::string_view name) {
  for (const std::string_view unit : {"_m", "_deg", "_rad"})
    if (name.ends_with(unit)) name.remove_suffix(unit.size());
  std::string words(name);
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

/// Makes a field of every field of a look.
class FormMaker {
 public:
  explicit FormMaker(const LookDesc& look) : look_(look) {}

  template <class T>
  void number(const char* name, const T& value, const Range& range) {
    FormField field = field_of(name, static_cast<double>(value), range);
    field.widget = std::is_integral_v<T> ? FormWidget::Whole : FormWidget::Slider;
    add(std::move(field));
  }
  void vector(const char* name, const glm::vec3& value, const Range& range) {
    FormField field = field_of(name, value, range);
    field.widget = FormWidget::Direction;
    add(std::move(field));
  }
  void color(const char* name, const glm::vec3& value, const Range& range) {
    FormField field = field_of(name, value, range);
    field.widget = FormWidget::Color;
    add(std::move(field));
  }
  void text(const char* name, const std::string& value, size_t) {
    FormField field = field_of(name, value, {});
    field.choices = names_of(field.path);
    field.widget = field.choices.empty() ? FormWidget::Text : FormWidget::Choice;
    add(std::move(field));
  }
  template <class Body>
  void group(const char* name, Body body) {
    const std::string outer = std::exchange(group_, fmt::format("{}{}.", group_, name));
    body();
    group_ = outer;
  }
  void require(const char*, bool, const char*) {}

  /// Those of one section together, and those of a section as the table has them.
  std::vector<FormField> take() {
    const auto rank = [](const FormField& field) {
      const auto section = std::find(kSections.begin(), kSections.end(), field.section) - kSections.begin();
      const Shown* row = find_shown(field.path);
      return std::pair(section, row != nullptr ? row - kShown.data() : std::ptrdiff_t{kShown.size()});
    };
    std::stable_sort(fields_.begin(), fields_.end(),
                     [&](const FormField& a, const FormField& b) { return rank(a) < rank(b); });
    return std::move(fields_);
  }

 private:
  FormField field_of(const char* name, FormValue value, const Range& range) const {
    FormField field;
    field.path = group_ + name;
    field.value = std::move(value);
    field.minimum = range.minimum;
    field.maximum = field.handy_maximum = range.maximum;
    field.unit = range.unit;
    if (field.unit == "m") {
      field.unit = "mm";
      field.shown_per_unit = kMmPerM;
    }
    const Shown* row = find_shown(field.path);
    field.section = row != nullptr         ? row->section
                    : group_ == "style."   ? kStyle
                    : group_ == "shading." ? kShading
                                           : kOther;
    field.title = row != nullptr && !row->title.empty() ? std::string(row->title) : words_of(name);
    if (row != nullptr) field.help = row->help;
    if (row != nullptr && row->handy_maximum > 0.0) field.handy_maximum = row->handy_maximum;
    return field;
  }
  void add(FormField field) {
    field.is_idle = is_idle(look_, field.path);
    fields_.push_back(std::move(field));
  }

  const LookDesc& look_;
  std::string group_;  // with a dot behind it
  std::vector<FormField> fields_;
};

/// As a scene file writes it.
struct ValueText {
  bool is_color = false;

  std::string operator()(double number) const { return fmt::format(": {}", static_cast<float>(number)); }
  std::string operator()(const glm::vec3& v) const {
    return is_color ? fmt::format(" {{ r: {} g: {} b: {} }}", v.r, v.g, v.b)
                    : fmt::format(" {{ x: {} y: {} z: {} }}", v.x, v.y, v.z);
  }
  std::string operator()(const std::string& text) const {
    std::string quoted = ": \"";
    for (const char character : text) {
      if (character == '"' || character == '\\') quoted += '\\';
      quoted += character;
    }
    return quoted + '"';
  }
};

std::string text_of(const FormEdit& edit, const std::vector<FormField>& fields) {
  const auto field =
      std::find_if(fields.begin(), fields.end(), [&](const FormField& one) { return one.path == edit.path; });
  CHECK(field != fields.end());
  const size_t dot = edit.path.find('.');
  const std::string value = std::visit(ValueText{field->widget == FormWidget::Color}, edit.value);
  if (dot == std::string::npos) return edit.path + value;
  return fmt::format("{} {{ {}{} }}", edit.path.substr(0, dot), edit.path.substr(dot + 1), value);
}

}  // namespace

std::vector<FormField> look_fields(const LookDesc& look) {
  LookDesc copy = look;  // the visitor is shared with readers, which write
  FormMaker maker(look);
  scene_fields::visit_look(maker, copy);
  return maker.take();
}

std::vector<FormEdit> completed(const LookDesc& seen, std::vector<FormEdit> edits) {
  const FormEdit own_colors{"hair_color", std::string(kOwnColors)};
  if (seen.hair_color == kOwnColors || std::find(edits.begin(), edits.end(), own_colors) == edits.end())
    return edits;
  const HairColors colors = colors_of(seen);
  edits.insert(edits.begin(), {{"root_color", colors.root}, {"tip_color", colors.tip}});
  return edits;
}

std::string look_assignment(const std::vector<FormEdit>& edits) {
  CHECK(!edits.empty());
  const std::vector<FormField> fields = look_fields(LookDesc{});
  std::string text = "look={";
  for (const FormEdit& edit : edits) text.append(" ").append(text_of(edit, fields));
  return text + " }";
}

Result<LookDesc> with_edits(const LookDesc& look, const std::vector<FormEdit>& edits) {
  if (edits.empty()) return look;
  SceneDesc scene;
  scene.look = look;
  ASSIGN_OR_RETURN(const SceneDesc changed, with_overrides(scene, {look_assignment(edits)}));
  return changed.look;
}

void LookControl::follow(const LookChange& scene, bool is_steering) {
  scene_ = scene;
  if (is_steering && !std::exchange(is_steering_, is_steering)) own_.reset();
  is_steering_ = is_steering;
  if (!is_steering) held_.clear();
}

Status LookControl::edit(const std::vector<FormEdit>& edits, int64_t time_ns) {
  Status status;
  for (const FormEdit& edit : completed(shown(time_ns), edits)) {
    Result<LookDesc> changed = with_edits(shown(time_ns), {edit});
    if (!changed) {
      if (status) status = changed.error();
      continue;
    }
    if (is_steering_)
      held_[edit.path] = {edit.value, time_ns, false};
    else
      own_ = std::move(changed).value();
  }
  return status;
}

std::optional<std::string> LookControl::take_assignment(int64_t time_ns) {
  std::erase_if(held_, [&](const auto& entry) {
    return entry.second.is_sent && time_ns - entry.second.time_ns >= kLookHoldNs;
  });
  if (sent_ns_ != 0 && time_ns - sent_ns_ < kLookSendNs) return std::nullopt;
  std::vector<FormEdit> unsent;
  for (const auto& [path, held] : held_)
    if (!held.is_sent) unsent.push_back({path, held.value});
  if (unsent.empty()) return std::nullopt;
  last_sent_.clear();
  for (const FormEdit& edit : unsent) {
    held_[edit.path] = {edit.value, time_ns, true};
    last_sent_.push_back(edit.path);
  }
  sent_ns_ = time_ns;
  return look_assignment(unsent);
}

void LookControl::put_back() {
  for (const std::string& path : last_sent_)
    if (const auto held = held_.find(path); held != held_.end()) held->second.is_sent = false;
}

LookDesc LookControl::shown(int64_t time_ns) const {
  if (own_) return *own_;
  std::vector<FormEdit> edits;
  for (const auto& [path, held] : held_)
    if (!held.is_sent || time_ns - held.time_ns < kLookHoldNs) edits.push_back({path, held.value});
  const Result<LookDesc> look = with_edits(scene_.look, edits);
  return look ? *look : scene_.look;
}

FormState LookControl::form(bool are_frames, int64_t time_ns) const {
  FormState form;
  form.title = "Look";
  if (is_steering_) {
    form.notes.emplace_back("What you change here everybody sees.");
    form.save_note = "The whole scene as the server runs it, with this look and this view.";
  } else {
    form.notes.emplace_back(own_ ? "You see a look of your own. Nobody else does."
                                 : "What you change here you alone see: this viewer may not steer.");
    if (are_frames)
      form.notes.emplace_back("These are the server's pictures: a look of your own shows with strands (M).");
    form.save_note =
        "Look and view alone: a viewer that may not steer does not get the rest of the scene. All else has "
        "its "
        "default then.";
    if (own_) form.undo = "Back to the scene's";
  }
  form.fields = look_fields(shown(time_ns));
  form.file = file_;
  return form;
}

}  // namespace strandcast
