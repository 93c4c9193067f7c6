// HairSliders: the sliders at the top of the panel that a newcomer changes first: quality and the factors on
// hair (common/scene/hair_controls.h), as the server lists them. Sessions that may steer can move them. Pure
// logic on given times, one thread.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/window/form.h"
#include "common/wire/messages.h"

namespace strandcast {

/// Prefixes for the ParameterRequest that supplies the sliders.
inline constexpr const char* kHairSliderPrefixes = "quality,hair.";
/// Returns whether a parameter of a server that can change it has a slider here.
bool has_hair_slider(const ParameterInfo& parameter);

class HairSliders {
 public:
  /// Takes the server's newest values and whether this session may change them.
  void follow(const std::vector<ParameterInfo>& parameters, bool is_steering);
  /// Removes the edits of these sliders from `edits` and applies them.
  void take_edits(std::vector<FormEdit>& edits, int64_t time_ns);
  /// Returns the next assignment to send by SetParameter, one slider at a time.
  std::optional<std::string> take_assignment(int64_t time_ns);

  /// Returns the fields, including edits that the server has not confirmed yet; disabled if this session may
  /// not steer.
  std::vector<FormField> fields(int64_t time_ns) const;
  /// Returns why the sliders are disabled; empty if they are not.
  std::string reason() const;

 private:
  struct Held {
    std::string value;
    int64_t time_ns = 0;
    bool is_sent = false;
  };
  std::vector<ParameterInfo> parameters_;
  bool is_steering_ = false;
  std::map<std::string, Held> held_;  // by path
  int64_t sent_ns_ = 0;               // 0 = never
};

}  // namespace strandcast
