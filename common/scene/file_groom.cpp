#include "common/scene/file_groom.h"

#include <utility>

#include "common/groom/head_fit.h"

namespace strandcast {

Result<FileGroom> load_file_groom(const FileGroomDesc& file) {
  GroomFileOptions options;
  options.path = file.path;
  options.more_paths = file.more_paths;
  options.unit_m = file.unit_m;
  const UpAxis up = file.up_axis;
  options.is_z_up = file.has_up_axis ? std::optional(up == UpAxis::Z || up == UpAxis::MinusZ) : std::nullopt;
  options.is_upside_down = up == UpAxis::MinusY || up == UpAxis::MinusZ;
  options.yaw_deg = file.has_yaw ? std::optional(file.yaw_deg) : std::nullopt;
  options.origin = file.has_origin ? std::optional(file.origin) : std::nullopt;
  options.vertex_count = file.vertex_count;
  options.strand_vertex_count = file.strand_vertex_count;
  options.guides = file.guides ? GuideUse::Alone : GuideUse::LeaveOut;
  if (file.has_pinning) options.pinning = file.pinning;
  FileGroom hair;
  ASSIGN_OR_RETURN(hair.placed, load_placed_groom(options));
  if (!file.has_origin) {
    const glm::vec3 shift_m = -fit_head(hair.placed.groom).center_m;
    for (glm::vec3& position : hair.placed.groom.rest_position_m) position += shift_m;
    hair.placed.placement.shift_m = shift_m;
  }
  hair.order = make_prefix_order(hair.placed.groom);
  return hair;
}

}  // namespace strandcast
