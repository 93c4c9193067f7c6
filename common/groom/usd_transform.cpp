// The transform stack of USD prims.
#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>

#include "common/groom/text_scan.h"
#include "common/groom/usd_stage.h"

namespace strandcast {
namespace {

constexpr std::string_view kPrefix = "xformOp:";
constexpr std::string_view kInverse = "!invert!";
constexpr std::string_view kReset = "!resetXformStack!";

glm::dmat4 turned(char axis, double angle_deg) {
  const glm::dvec3 about = axis == 'X'   ? glm::dvec3(1, 0, 0)
                           : axis == 'Y' ? glm::dvec3(0, 1, 0)
                                         : glm::dvec3(0, 0, 1);
  return glm::rotate(glm::dmat4(1.0), glm::radians(angle_deg), about);
}

/// About one axis ("X") or three, the first letter's first.
Result<glm::dmat4> rotation(std::string_view axes, const std::vector<double>& angle_deg) {
  std::string sorted(axes);
  std::sort(sorted.begin(), sorted.end());
  const bool is_known = sorted == "XYZ" || sorted == "X" || sorted == "Y" || sorted == "Z";
  if (!is_known || angle_deg.size() != axes.size())
    return make_error(ErrorCode::BadInput, "rotation {} with {} angles", quoted(axes), angle_deg.size());
  glm::dmat4 turn(1.0);
  for (const char axis : axes)
    turn = turned(axis, axes.size() == 1 ? angle_deg[0] : angle_deg[static_cast<size_t>(axis - 'X')]) * turn;
  return turn;
}

Result<glm::dmat4> matrix_of(std::string_view type, const UsdXformOp& op) {
  const std::vector<double>& value = op.value;
  if (type == "translate" && value.size() == 3)
    return glm::translate(glm::dmat4(1.0), glm::dvec3(value[0], value[1], value[2]));
  if (type == "scale" && value.size() == 3)
    return glm::scale(glm::dmat4(1.0), glm::dvec3(value[0], value[1], value[2]));
  if (type == "orient" && value.size() == 4) {
    const glm::dquat turn(value[0], value[1], value[2], value[3]);  // (w, x, y, z), as USD writes it
    if (!(glm::length(turn) > 1e-6)) return make_error(ErrorCode::BadInput, "{} is no rotation", op.name);
    return glm::mat4_cast(glm::normalize(turn));
  }
  if (type == "transform" && value.size() == 16) {
    // USD's rows are what a row vector is multiplied with: columns here.
    glm::dmat4 matrix;
    for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = value[static_cast<size_t>(i)];
    return matrix;
  }
  if (type.starts_with("rotate")) return rotation(type.substr(6), value);
  return make_error(ErrorCode::BadInput, "transform {} with {} numbers is not known",
                    strandcast::quoted(op.name), value.size());
}

struct Local {
  glm::dmat4 parent_from_prim{1.0};
  bool is_reset = false;  // what is above does not count
};

Result<Local> local_of(const UsdPrim& prim) {
  Local local;
  for (const std::string& step : prim.op_order) {
    std::string_view name = step;
    if (name == kReset) {
      local = {glm::dmat4(1.0), true};
      continue;
    }
    const bool is_inverse = name.starts_with(kInverse);
    if (is_inverse) name.remove_prefix(kInverse.size());
    const auto op = std::find_if(prim.op.begin(), prim.op.end(),
                                 [&](const UsdXformOp& known) { return known.name == name; });
    if (op == prim.op.end() || !name.starts_with(kPrefix))
      return make_error(ErrorCode::BadInput, "prim {} names the transform {}, which it does not have",
                        strandcast::quoted(prim.name), strandcast::quoted(step));
    std::string_view type = name.substr(kPrefix.size());
    type = type.substr(0, type.find(':'));
    ASSIGN_OR_RETURN(glm::dmat4 matrix, matrix_of(type, *op));
    if (is_inverse) matrix = glm::inverse(matrix);
    local.parent_from_prim = local.parent_from_prim * matrix;
  }
  return local;
}

}  // namespace

Result<glm::dmat4> world_from_prim(const UsdStage& stage, size_t prim) {
  glm::dmat4 world(1.0);
  for (std::optional<size_t> i = prim; i; i = stage.prim[*i].parent) {
    ASSIGN_OR_RETURN(const Local local, local_of(stage.prim[*i]));
    world = local.parent_from_prim * world;
    if (local.is_reset) break;
  }
  return world;
}

}  // namespace strandcast
