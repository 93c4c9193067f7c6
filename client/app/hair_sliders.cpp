#include "client/app/hair_sliders.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "client/app/look_form.h"
#include "common/scene/hair_controls.h"
#include "common/scene/scene_desc.h"

namespace strandcast {
namespace {

constexpr const char* kQualityPath = "quality";
constexpr double kLogRatio = 10.0;  // of a range, from which on its slider is logarithmic

/// "hair.length" is "Length".
std::string title_of(const std::string& path) {
  std::string title = path.substr(path.rfind('.') + 1);
  if (!title.empty()) title[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(title[0])));
  return title;
}

double number_of(const std::string& text) {
  return std::strtod(text.c_str(), nullptr);
}

std::string text_of(const FormValue& value) {
  if (const auto* name = std::get_if<std::string>(&value)) return *name;
  return fmt::format("{:.3g}", std::get<double>(value));
}

FormField field_of(const ParameterInfo& parameter, const std::string& value) {
  FormField field;
  field.path = parameter.path;
  field.title = title_of(parameter.path);
  field.help = parameter.note;
  if (!parameter.has_range) {
    field.widget = FormWidget::Stops;
    field.choices = {kFastQuality, kAutoQuality, kFullQuality};  // from the least to do to the most
    field.value = value;
    field.usual = parameter.unset_value;
    return field;
  }
  field.help +=
      fmt::format(" ({} {}). Double click on the name: {}", value, parameter.unit, parameter.unset_value);
  field.value = number_of(value);
  field.usual = number_of(parameter.unset_value);
  field.minimum = parameter.minimum;
  field.maximum = field.handy_maximum = parameter.maximum;
  field.is_logarithmic = field.minimum > 0.0 && field.maximum >= kLogRatio * field.minimum;
  return field;
}

}  // namespace

bool has_hair_slider(const ParameterInfo& parameter) {
  const bool is_hair = parameter.path.starts_with("hair.") && parameter.has_range;
  return parameter.is_live && (is_hair || parameter.path == kQualityPath);
}

void HairSliders::follow(const std::vector<ParameterInfo>& parameters, bool is_steering) {
  parameters_.clear();
  std::copy_if(parameters.begin(), parameters.end(), std::back_inserter(parameters_), has_hair_slider);
  is_steering_ = is_steering;
  if (!is_steering) held_.clear();
}

void HairSliders::take_edits(std::vector<FormEdit>& edits, int64_t time_ns) {
  std::erase_if(edits, [&](const FormEdit& edit) {
    const bool is_one =
        std::any_of(parameters_.begin(), parameters_.end(),
                    [&](const ParameterInfo& parameter) { return parameter.path == edit.path; });
    if (is_one && is_steering_) held_[edit.path] = {text_of(edit.value), time_ns, false};
    return is_one;
  });
}

std::optional<std::string> HairSliders::take_assignment(int64_t time_ns) {
  std::erase_if(held_, [&](const auto& entry) {
    return entry.second.is_sent && time_ns - entry.second.time_ns >= kLookHoldNs;
  });
  if (sent_ns_ != 0 && time_ns - sent_ns_ < kLookSendNs) return std::nullopt;
  for (auto& [path, held] : held_) {
    if (std::exchange(held.is_sent, true)) continue;
    held.time_ns = sent_ns_ = time_ns;
    return path + '=' + held.value;
  }
  return std::nullopt;
}

std::vector<FormField> HairSliders::fields(int64_t time_ns) const {
  std::vector<FormField> fields;
  for (const ParameterInfo& parameter : parameters_) {
    const auto held = held_.find(parameter.path);
    const bool is_held =
        held != held_.end() && (!held->second.is_sent || time_ns - held->second.time_ns < kLookHoldNs);
    fields.push_back(field_of(parameter, is_held ? held->second.value : parameter.value));
    fields.back().is_idle = !is_steering_;
  }
  return fields;
}

std::string HairSliders::reason() const {
  if (is_steering_ || parameters_.empty()) return {};
  return "This viewer may not steer: the server gave it no right to move these.";
}

}  // namespace strandcast
