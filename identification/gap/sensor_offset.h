/// @file
/// An offset between command and measured torque: of the actuator, or of the torque sensor.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "identification/gap/fitted_model.h"
#include "identification/gap/gap.h"
#include "model/effects/drive_model.h"

namespace identification::gap {

/// Subtracts the offset that `base` gives to the torque sensor from all measured torques: the search looks
/// for what is not known.
void remove_sensor_offset(std::vector<Source>& sources, const model::effects::DriveModel& base);

/// The motion is compared with the measured torque: if the sensor is wrong, it needs a torque_offset of the
/// size by which command and measured torque differ; if the actuator is, none.
enum class OffsetOf : std::uint8_t { kActuator, kSensor, kEither };
/// Of an actuator_offset in `found`: from the torque_offset that `fitted` needs beyond the one of `given`,
/// with its interval. kEither if that contains both sizes, or neither.
OffsetOf offset_of(const FoundEffect& found, const model::effects::DriveModel& given,
                   const FittedModel& fitted, const Rows& rows, const std::vector<Eigen::Index>& use);

/// Makes the actuator_offset in `found` a torque_sensor_offset, beside one that `given` may have. Takes the
/// torque_offset that stood for it out of the result's model.
void give_to_sensor(FoundEffect& found, const model::effects::DriveModel& given, Result& result);

}  // namespace identification::gap
