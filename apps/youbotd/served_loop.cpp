#include "apps/youbotd/served_loop.h"

namespace youbotd {

void ServedLoop::step(std::chrono::nanoseconds now) noexcept {
  const bool slept = run_ != nullptr && now - last_step_ > silence_;
  heed(now);
  last_step_ = now;
  if (run_ == nullptr) {
    idle();
    return;
  }
  run_->step(now);
  // The run has seen the pause first, and reports it if that stops the run. Nothing could have stopped the
  // run during the pause.
  if (slept) call_off();
}

void ServedLoop::call_off() noexcept {
  // A run that has ended by itself needs no orders.
  report_.unheard = report_.unheard || (!resting_ && !orders_.stop && !orders_.off && !run_->finished());
  run_->request_stop();
}

void ServedLoop::heed(std::chrono::nanoseconds now) noexcept {
  if (orders_channel_.take(orders_)) last_order_ = now;
  report_.heard = orders_.serial;
  // As of the previous step: a pause of this loop is not silence of the other thread.
  const bool heard = last_order_ && last_step_ - *last_order_ <= silence_;
  const bool wanted = heard && !resting_ && !orders_.stop && !orders_.off;
  if (run_ == nullptr && wanted && orders_.run != nullptr && orders_.number > number_) {
    run_ = orders_.run;
    number_ = orders_.number;
    report_.master = {};
    report_.master_left = false;
    report_.unheard = false;
    if (capture_ != nullptr) capture_->resume();
  } else if (run_ == nullptr && orders_.run != nullptr && orders_.number > number_) {
    report_.ended = number_ = orders_.number;  // cancelled before it began
    report_.unheard = false;
  }
  if (run_ == nullptr) return;
  if (heard && orders_.off)
    run_->switch_off();
  else if (!heard)
    call_off();
  else if (!wanted)
    run_->request_stop();
}

void ServedLoop::idle() noexcept {
  report_.robot = robot_.exchange({}, robot_sample_);
  report_.master_left = orders_.leave_master;
  if (master_ != nullptr && !orders_.leave_master) report_.master = master_->exchange({}, master_sample_);
}

/// What the joints measure while the drives are off.
void ServedLoop::show_idle() noexcept {
  if (live_ == nullptr) return;
  const bool fresh = report_.robot.ok();
  const auto measured = [this, fresh](auto& record) {
    constexpr double kNaN = operation::CycleRecord::kNaN;
    for (std::size_t i = 0; i < record.position_rad.size(); ++i) {
      record.position_rad[i] = fresh ? robot_sample_.joints[i].position_rad : kNaN;
      record.torque_measured_Nm[i] = fresh ? robot_sample_.joints[i].torque_Nm : kNaN;
    }
    record.wake_up = times_.wake_up;
    record.step = times_.step;
  };
  if (master_ != nullptr) {
    operation::TeleopRecord record;
    record.setpoint_p_WT_m = record.tip_p_WT_m = record.base_W = operation::CycleRecord::kUnknown;
    record.command.fill(operation::CycleRecord::kNaN);
    record.held_force_H_N = record.grip_force_H_N = operation::CycleRecord::kUnknown;
    record.wrench_W.fill(operation::CycleRecord::kNaN);
    record.tank_J = operation::CycleRecord::kNaN;
    measured(record);
    live_->add(record, /*running=*/false);
  } else {
    operation::CycleRecord record{.phase = operation::Phase::kOff};
    record.odometry_W = operation::CycleRecord::kUnknown;
    record.torque_command_Nm.fill(operation::CycleRecord::kNaN);
    for (std::size_t i = 0; i < record.velocity_rad_per_s.size(); ++i)
      record.velocity_rad_per_s[i] = record.reported_velocity_rad_per_s[i] =
          fresh ? robot_sample_.joints[i].velocity_rad_per_s : operation::CycleRecord::kNaN;
    measured(record);
    live_->add(record, /*running=*/false);
  }
}

void ServedLoop::keep() noexcept {
  ++report_.cycles;
  if (run_ != nullptr) {
    run_->record() = times_;
    run_->keep();
    report_.progress = run_->progress();
    if (run_->finished()) {
      run_ = nullptr;
      if (capture_ != nullptr) capture_->stop_after(0);
      report_.ended = number_;
    }
  } else {
    report_.progress = {};
    show_idle();
  }
  reports_.publish(report_);
}

}  // namespace youbotd
