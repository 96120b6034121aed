"""Parameter names and types of Nav2, slam_toolbox, robot_localization and depthimage_to_laserscan, as data.

Jazzy's and Kilted's common names, read off the configuration guide (https://docs.nav2.org/configuration, one page per
component), its migration notes "Iron to Jazzy" and "Jazzy to Kilted", slam_toolbox's README and example files,
robot_localization's params/ekf.yaml and depthimage_to_laserscan's node. ROS 2 ignores a name that nobody declared,
and refuses a value of another type at start: both are found here before.
"""

from __future__ import annotations

from collections.abc import Mapping

DISTRIBUTIONS = ("jazzy", "kilted")
MPPI, DWB = "nav2_mppi_controller::MPPIController", "dwb_core::DWBLocalPlanner"

NAMES: Mapping[str, str] = {
    "amcl": """
        double: alpha1 alpha2 alpha3 alpha4 alpha5 beam_skip_distance beam_skip_error_threshold
            beam_skip_threshold lambda_short laser_likelihood_max_dist laser_max_range
            laser_min_range pf_err pf_z recovery_alpha_fast recovery_alpha_slow save_pose_rate
            sigma_hit transform_tolerance update_min_a update_min_d z_hit z_max z_rand z_short
            bond_heartbeat_period
        int: max_beams max_particles min_particles resample_interval random_seed
        bool: do_beamskip tf_broadcast set_initial_pose always_reset_initial_pose first_map_only
            freespace_downsampling
        string: base_frame_id global_frame_id odom_frame_id laser_model_type robot_model_type
            scan_topic map_topic
    """,
    "bt_navigator": """
        string: global_frame robot_base_frame odom_topic default_nav_to_pose_bt_xml
            default_nav_through_poses_bt_xml
        int: bt_loop_duration default_server_timeout wait_for_service_timeout
        double: filter_duration transform_tolerance bond_heartbeat_period
        bool: always_reload_bt_xml
        strings: navigators plugin_lib_names
    """,
    "controller_server": """
        double: controller_frequency min_x_velocity_threshold min_y_velocity_threshold
            min_theta_velocity_threshold failure_tolerance costmap_update_timeout
            bond_heartbeat_period
        strings: progress_checker_plugins goal_checker_plugins controller_plugins
        bool: use_realtime_priority enable_stamped_cmd_vel publish_zero_velocity
        string: odom_topic speed_limit_topic
    """,
    "planner_server": """
        double: expected_planner_frequency costmap_update_timeout bond_heartbeat_period
        strings: planner_plugins
    """,
    "smoother_server": """
        strings: smoother_plugins
        string: costmap_topic footprint_topic robot_base_frame
        double: transform_tolerance bond_heartbeat_period
    """,
    "behavior_server": """
        string: local_costmap_topic global_costmap_topic local_footprint_topic
            global_footprint_topic local_frame global_frame robot_base_frame cmd_vel_teleop
        strings: behavior_plugins
        double: cycle_frequency transform_tolerance simulate_ahead_time max_rotational_vel
            min_rotational_vel rotational_acc_lim projection_time simulation_time_step
            bond_heartbeat_period
        bool: enable_stamped_cmd_vel
    """,
    "velocity_smoother": """
        double: smoothing_frequency velocity_timeout odom_duration bond_heartbeat_period
        bool: scale_velocities enable_stamped_cmd_vel use_realtime_priority
        string: feedback odom_topic
        doubles: max_velocity min_velocity max_accel max_decel deadband_velocity
    """,
    "collision_monitor": """
        string: base_frame_id odom_frame_id cmd_vel_in_topic cmd_vel_out_topic state_topic
        double: transform_tolerance source_timeout stop_pub_timeout bond_heartbeat_period
        bool: base_shift_correction use_realtime_priority enable_stamped_cmd_vel
        strings: polygons observation_sources
    """,
    "collision_monitor/polygon": """
        string: type points action_type polygon_sub_topic polygon_pub_topic footprint_topic
        double: radius time_before_collision simulation_time_step slowdown_ratio linear_limit
            angular_limit
        int: min_points
        bool: visualize enabled polygon_subscribe_transient_local
    """,
    "collision_monitor/source": """
        string: type topic
        double: source_timeout min_height max_height obstacles_angle
        bool: enabled
    """,
    "waypoint_follower": """
        int: loop_rate
        bool: stop_on_failure
        string: waypoint_task_executor_plugin
        double: bond_heartbeat_period
    """,
    "local_costmap": "@costmap",
    "global_costmap": "@costmap",
    "@costmap": """
        bool: always_send_full_costmap rolling_window track_unknown_space trinary_costmap
            use_maximum
        double: footprint_padding origin_x origin_y publish_frequency resolution robot_radius
            transform_tolerance initial_transform_timeout update_frequency
        int: height width lethal_cost_threshold unknown_cost_value
        string: footprint global_frame robot_base_frame observation_sources
        strings: plugins filters
    """,
    "nav2_bt_navigator::NavigateToPoseNavigator": "",
    "nav2_bt_navigator::NavigateThroughPosesNavigator": "",
    "nav2_controller::PoseProgressChecker": """
        double: required_movement_radius required_movement_angle movement_time_allowance
    """,
    "nav2_controller::SimpleGoalChecker": """
        double: xy_goal_tolerance yaw_goal_tolerance
        bool: stateful
    """,
    MPPI: """
        string: motion_model
        int: time_steps batch_size iteration_count retry_attempt_limit
        double: model_dt vx_std vy_std wz_std vx_max vx_min vy_max wz_max ax_max ax_min ay_max
            ay_min az_max temperature gamma prune_distance max_robot_pose_search_dist
            transform_tolerance inversion_xy_tolerance inversion_yaw_tolerance
        bool: visualize regenerate_noises enforce_path_inversion
        strings: critics
    """,
    f"{MPPI}/TrajectoryVisualizer": "int: trajectory_step time_step",
    f"{MPPI}/ConstraintCritic": """
        bool: enabled
        int: cost_power
        double: cost_weight
    """,
    f"{MPPI}/GoalCritic": """
        bool: enabled
        int: cost_power
        double: cost_weight threshold_to_consider
    """,
    f"{MPPI}/GoalAngleCritic": """
        bool: enabled
        int: cost_power
        double: cost_weight threshold_to_consider
    """,
    f"{MPPI}/PreferForwardCritic": """
        bool: enabled
        int: cost_power
        double: cost_weight threshold_to_consider
    """,
    f"{MPPI}/CostCritic": """
        bool: enabled consider_footprint
        int: cost_power near_collision_cost trajectory_point_step
        double: cost_weight critical_cost collision_cost near_goal_distance
        string: inflation_layer_name
    """,
    f"{MPPI}/PathAlignCritic": """
        bool: enabled use_path_orientations
        int: cost_power trajectory_point_step offset_from_furthest
        double: cost_weight threshold_to_consider max_path_occupancy_ratio
    """,
    f"{MPPI}/PathFollowCritic": """
        bool: enabled
        int: cost_power offset_from_furthest
        double: cost_weight threshold_to_consider
    """,
    f"{MPPI}/PathAngleCritic": """
        bool: enabled
        int: cost_power offset_from_furthest mode
        double: cost_weight threshold_to_consider max_angle_to_furthest
    """,
    DWB: """
        double: min_vel_x max_vel_x min_vel_y max_vel_y max_vel_theta min_speed_xy max_speed_xy
            min_speed_theta acc_lim_x acc_lim_y acc_lim_theta decel_lim_x decel_lim_y
            decel_lim_theta sim_time linear_granularity angular_granularity time_granularity
            transform_tolerance xy_goal_tolerance trans_stopped_velocity prune_distance
        int: vx_samples vy_samples vtheta_samples
        bool: debug_trajectory_details short_circuit_trajectory_evaluation stateful
        strings: critics
    """,
    f"{DWB}/BaseObstacle": """
        double: scale
        bool: sum_scores
    """,
    f"{DWB}/PathAlign": "double: scale forward_point_distance",
    f"{DWB}/GoalAlign": "double: scale forward_point_distance",
    f"{DWB}/PathDist": "double: scale",
    f"{DWB}/GoalDist": "double: scale",
    f"{DWB}/RotateToGoal": "double: scale slowing_factor lookahead_time",
    "nav2_navfn_planner::NavfnPlanner": """
        double: tolerance
        bool: use_astar allow_unknown use_final_approach_orientation
    """,
    "nav2_smoother::SimpleSmoother": """
        double: tolerance w_data w_smooth
        int: max_its refinement_num
        bool: do_refinement
    """,
    "nav2_behaviors::Spin": "",
    "nav2_behaviors::BackUp": "",
    "nav2_behaviors::DriveOnHeading": "",
    "nav2_behaviors::AssistedTeleop": "",
    "nav2_behaviors::Wait": "",
    "nav2_waypoint_follower::WaitAtWaypoint": """
        bool: enabled
        int: waypoint_pause_duration
    """,
    "nav2_costmap_2d::StaticLayer": """
        bool: enabled map_subscribe_transient_local subscribe_to_updates
        double: transform_tolerance
        string: map_topic
    """,
    "nav2_costmap_2d::InflationLayer": """
        bool: enabled inflate_unknown inflate_around_unknown
        double: inflation_radius cost_scaling_factor
    """,
    "nav2_costmap_2d::ObstacleLayer": """
        bool: enabled footprint_clearing_enabled
        double: min_obstacle_height max_obstacle_height tf_filter_tolerance
        int: combination_method
        string: observation_sources
    """,
    "nav2_costmap_2d::ObstacleLayer/source": """
        string: topic sensor_frame data_type
        bool: marking clearing inf_is_valid
        double: observation_persistence expected_update_rate min_obstacle_height max_obstacle_height
            obstacle_max_range obstacle_min_range raytrace_max_range raytrace_min_range
    """,
    "slam_toolbox": """
        string: solver_plugin ceres_linear_solver ceres_preconditioner ceres_trust_strategy
            ceres_dogleg_type ceres_loss_function odom_frame map_frame base_frame scan_topic mode
            map_file_name
        bool: debug_logging use_map_saver enable_interactive_mode use_scan_matching
            use_scan_barycenter do_loop_closing use_response_expansion map_start_at_dock
        int: throttle_scans stack_size_to_use scan_buffer_size loop_match_minimum_chain_size
            min_pass_through
        double: transform_publish_period map_update_interval resolution min_laser_range
            max_laser_range minimum_time_interval transform_timeout tf_buffer_duration
            minimum_travel_distance minimum_travel_heading scan_buffer_maximum_scan_distance
            link_match_minimum_response_fine link_scan_maximum_distance loop_search_maximum_distance
            loop_match_maximum_variance_coarse loop_match_minimum_response_coarse
            loop_match_minimum_response_fine correlation_search_space_dimension
            correlation_search_space_resolution correlation_search_space_smear_deviation
            loop_search_space_dimension loop_search_space_resolution
            loop_search_space_smear_deviation distance_variance_penalty angle_variance_penalty
            fine_search_angle_offset coarse_search_angle_offset coarse_angle_resolution
            minimum_angle_penalty minimum_distance_penalty occupancy_threshold
        doubles: map_start_pose
    """,
    "ekf_filter_node": """
        double: frequency sensor_timeout transform_time_offset transform_timeout control_timeout
            odom0_pose_rejection_threshold odom0_twist_rejection_threshold
            imu0_twist_rejection_threshold
        bool: two_d_mode publish_tf publish_acceleration print_diagnostics debug use_control
            stamped_control odom0_differential odom0_relative odom0_nodelay imu0_differential
            imu0_relative imu0_nodelay imu0_remove_gravitational_acceleration smooth_lagged_data
            reset_on_time_jump permit_corrected_publication
        string: map_frame odom_frame base_link_frame world_frame odom0 imu0
        int: odom0_queue_size imu0_queue_size
        bools: odom0_config imu0_config
        doubles: process_noise_covariance initial_estimate_covariance
    """,
    "depthimage_to_laserscan": """
        string: output_frame
        int: scan_height
        double: scan_time range_min range_max
    """,
}
"""Node or plugin to its parameters: a type with a colon, then its names; a component in another is `outer/inner`."""
ONLY: Mapping[str, tuple[str, str]] = {"controller_server/publish_zero_velocity": ("kilted", "bool")}
"""What one distribution has added (migration note "Jazzy to Kilted"): none of these is written."""
