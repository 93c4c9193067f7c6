// A form beside the picture: fields with ranges, the person's edits, and the panel that shows them. The
// application defines what the fields mean.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "client/window/hud.h"

namespace strandcast {

/// Value of a number, of a colour or direction, or of a name.
using FormValue = std::variant<double, glm::vec3, std::string>;

// Stops: names in an order, along a slider.
enum class FormWidget { Slider, Whole, Color, Direction, Choice, Text, Stops };

struct FormField {
  std::string path;     // names it in an edit
  std::string section;  // fields of one section stand together; empty: on top, and all else below More
  std::string title;
  std::string help;  // shown beside the pointer; may be empty
  std::string unit;  // may be empty
  FormWidget widget = FormWidget::Slider;
  FormValue value = 0.0;
  double minimum = 0.0;  // of a number, or of each component
  double maximum = 1.0;
  double handy_maximum = 1.0;  // where a slider ends; more can be typed, up to maximum
  double shown_per_unit = 1.0;
  bool is_logarithmic = false;       // a Slider, of a minimum above 0
  std::optional<FormValue> usual;    // that a double click on the title brings back; nothing: none does
  bool is_idle = false;              // shown, but it decides nothing now
  std::vector<std::string> choices;  // of a Choice or Stops
};

struct FormState {
  std::string title;
  std::vector<std::string> notes;  // whom it concerns
  std::string top_note;            // of the fields on top; may be empty
  std::vector<FormField> fields;
  std::string undo;       // the name of a button that takes all changes back; empty: there is none
  std::string share;      // of one that shows others this view; empty: there is none
  std::string file;       // to save as
  std::string save_note;  // what is saved
};

struct FormEdit {
  std::string path;
  FormValue value;

  bool operator==(const FormEdit&) const = default;
};

/// Edits and button presses of a person.
struct FormActions {
  std::vector<FormEdit> edits;      // in order
  std::optional<std::string> file;  // another name
  bool wants_save = false;
  bool wants_undo = false;
  bool wants_share = false;

  bool is_empty() const { return edits.empty() && !file && !wants_save && !wants_undo && !wants_share; }
  void add(FormActions later);
};

/// Direction from which something comes, as seen from the centre: degrees about the up axis from +Z towards
/// +X, and degrees above the horizon.
struct DirectionAngles {
  double azimuth_deg = 0.0;
  double elevation_deg = 0.0;
};
/// Returns the angles from which something comes that travels along `direction`, which must not be zero.
DirectionAngles angles_of(const glm::vec3& direction);
/// Inverse of angles_of(); the result has this length.
glm::vec3 direction_of(const DirectionAngles& angles, float length);

/// Converts linear light, 0..1, to display values and back (sRGB, IEC 61966-2-1).
float to_srgb(float linear);
float from_srgb(float shown);

/// Draws the form at the right edge with Dear ImGui, between its NewFrame() and Render(), at most as high as
/// the window. Adds the person's edits to `actions`. Main thread only.
PanelSize draw_form_panel(const FormState& form, FormActions& actions);

}  // namespace strandcast
