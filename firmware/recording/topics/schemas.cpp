// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/topics/schemas.hpp"

namespace polygmap::recording {
namespace {

// A definition is followed by those that it is made of, each behind such a line.
#define POLYGMAP_MSG(name) \
  "\n================================================================================\nMSG: " name "\n"
#define POLYGMAP_VECTOR3 POLYGMAP_MSG("geometry_msgs/Vector3") "float64 x\nfloat64 y\nfloat64 z"
#define POLYGMAP_POINT POLYGMAP_MSG("geometry_msgs/Point") "float64 x\nfloat64 y\nfloat64 z"
#define POLYGMAP_QUATERNION POLYGMAP_MSG("geometry_msgs/Quaternion") "float64 x\nfloat64 y\nfloat64 z\nfloat64 w"
#define POLYGMAP_HEADER POLYGMAP_MSG("std_msgs/Header") "builtin_interfaces/Time stamp\nstring frame_id"
#define POLYGMAP_POSE \
  POLYGMAP_MSG("geometry_msgs/Pose") "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation"

constexpr char kImu[] =
    "std_msgs/Header header\n"
    "geometry_msgs/Quaternion orientation\n"
    "float64[9] orientation_covariance\n"
    "geometry_msgs/Vector3 angular_velocity\n"
    "float64[9] angular_velocity_covariance\n"
    "geometry_msgs/Vector3 linear_acceleration\n"
    "float64[9] linear_acceleration_covariance" POLYGMAP_HEADER POLYGMAP_QUATERNION POLYGMAP_VECTOR3;
constexpr char kJointState[] =
    "std_msgs/Header header\n"
    "string[] name\n"
    "float64[] position\n"
    "float64[] velocity\n"
    "float64[] effort" POLYGMAP_HEADER;
constexpr char kWrenchStamped[] =
    "std_msgs/Header header\n"
    "geometry_msgs/Wrench wrench" POLYGMAP_HEADER POLYGMAP_MSG("geometry_msgs/Wrench")
        "geometry_msgs/Vector3 force\n"
        "geometry_msgs/Vector3 torque" POLYGMAP_VECTOR3;
constexpr char kOdometry[] =
    "std_msgs/Header header\n"
    "string child_frame_id\n"
    "geometry_msgs/PoseWithCovariance pose\n"
    "geometry_msgs/TwistWithCovariance twist" POLYGMAP_HEADER POLYGMAP_MSG("geometry_msgs/PoseWithCovariance")
        "geometry_msgs/Pose pose\n"
        "float64[36] covariance" POLYGMAP_MSG("geometry_msgs/TwistWithCovariance")
            "geometry_msgs/Twist twist\n"
            "float64[36] covariance" POLYGMAP_MSG("geometry_msgs/Twist")
                "geometry_msgs/Vector3 linear\n"
                "geometry_msgs/Vector3 angular" POLYGMAP_POSE POLYGMAP_POINT POLYGMAP_QUATERNION POLYGMAP_VECTOR3;
constexpr char kTfMessage[] =
    "geometry_msgs/TransformStamped[] transforms" POLYGMAP_MSG("geometry_msgs/TransformStamped")
        "std_msgs/Header header\n"
        "string child_frame_id\n"
        "geometry_msgs/Transform transform" POLYGMAP_MSG("geometry_msgs/Transform")
            "geometry_msgs/Vector3 translation\n"
            "geometry_msgs/Quaternion rotation" POLYGMAP_HEADER POLYGMAP_VECTOR3 POLYGMAP_QUATERNION;
constexpr char kImage[] =
    "std_msgs/Header header\n"
    "uint32 height\n"
    "uint32 width\n"
    "string encoding\n"
    "uint8 is_bigendian\n"
    "uint32 step\n"
    "uint8[] data" POLYGMAP_HEADER;
constexpr char kCompressedImage[] =
    "std_msgs/Header header\n"
    "string format\n"
    "uint8[] data" POLYGMAP_HEADER;
constexpr char kCameraInfo[] =
    "std_msgs/Header header\n"
    "uint32 height\n"
    "uint32 width\n"
    "string distortion_model\n"
    "float64[] d\n"
    "float64[9] k\n"
    "float64[9] r\n"
    "float64[12] p\n"
    "uint32 binning_x\n"
    "uint32 binning_y\n"
    "sensor_msgs/RegionOfInterest roi" POLYGMAP_HEADER POLYGMAP_MSG("sensor_msgs/RegionOfInterest")
        "uint32 x_offset\n"
        "uint32 y_offset\n"
        "uint32 height\n"
        "uint32 width\n"
        "bool do_rectify";
constexpr char kPoseArray[] =
    "std_msgs/Header header\n"
    "geometry_msgs/Pose[] poses" POLYGMAP_HEADER POLYGMAP_POSE POLYGMAP_POINT POLYGMAP_QUATERNION;

#define POLYGMAP_COLOR POLYGMAP_MSG("foxglove_msgs/Color") "float64 r\nfloat64 g\nfloat64 b\nfloat64 a"
constexpr char kSceneUpdate[] =
    "foxglove_msgs/SceneEntityDeletion[] deletions\n"
    "foxglove_msgs/SceneEntity[] entities" POLYGMAP_MSG("foxglove_msgs/SceneEntityDeletion")
        "builtin_interfaces/Time timestamp\n"
        "uint8 MATCHING_ID=0\n"
        "uint8 ALL=1\n"
        "uint8 type\n"
        "string id" POLYGMAP_MSG("foxglove_msgs/SceneEntity")
            "builtin_interfaces/Time timestamp\n"
            "string frame_id\n"
            "string id\n"
            "builtin_interfaces/Duration lifetime\n"
            "bool frame_locked\n"
            "foxglove_msgs/KeyValuePair[] metadata\n"
            "foxglove_msgs/ArrowPrimitive[] arrows\n"
            "foxglove_msgs/CubePrimitive[] cubes\n"
            "foxglove_msgs/SpherePrimitive[] spheres\n"
            "foxglove_msgs/CylinderPrimitive[] cylinders\n"
            "foxglove_msgs/LinePrimitive[] lines\n"
            "foxglove_msgs/TriangleListPrimitive[] triangles\n"
            "foxglove_msgs/TextPrimitive[] texts\n"
            "foxglove_msgs/ModelPrimitive[] models" POLYGMAP_MSG("foxglove_msgs/KeyValuePair")
                "string key\n"
                "string value" POLYGMAP_MSG("foxglove_msgs/ArrowPrimitive")
                    "geometry_msgs/Pose pose\n"
                    "float64 shaft_length\n"
                    "float64 shaft_diameter\n"
                    "float64 head_length\n"
                    "float64 head_diameter\n"
                    "foxglove_msgs/Color color" POLYGMAP_MSG("foxglove_msgs/CubePrimitive")
                        "geometry_msgs/Pose pose\n"
                        "geometry_msgs/Vector3 size\n"
                        "foxglove_msgs/Color color" POLYGMAP_MSG("foxglove_msgs/SpherePrimitive")
                            "geometry_msgs/Pose pose\n"
                            "geometry_msgs/Vector3 size\n"
                            "foxglove_msgs/Color color" POLYGMAP_MSG("foxglove_msgs/CylinderPrimitive")
                                "geometry_msgs/Pose pose\n"
                                "geometry_msgs/Vector3 size\n"
                                "float64 bottom_scale\n"
                                "float64 top_scale\n"
                                "foxglove_msgs/Color color" POLYGMAP_MSG("foxglove_msgs/LinePrimitive")
                                    "uint8 LINE_STRIP=0\n"
                                    "uint8 LINE_LOOP=1\n"
                                    "uint8 LINE_LIST=2\n"
                                    "uint8 type\n"
                                    "geometry_msgs/Pose pose\n"
                                    "float64 thickness\n"
                                    "bool scale_invariant\n"
                                    "geometry_msgs/Point[] points\n"
                                    "foxglove_msgs/Color color\n"
                                    "foxglove_msgs/Color[] colors\n"
                                    "uint32[] indices" POLYGMAP_MSG("foxglove_msgs/TriangleListPrimitive")
                                        "geometry_msgs/Pose pose\n"
                                        "geometry_msgs/Point[] points\n"
                                        "foxglove_msgs/Color color\n"
                                        "foxglove_msgs/Color[] colors\n"
                                        "uint32[] indices" POLYGMAP_MSG("foxglove_msgs/TextPrimitive")
                                            "geometry_msgs/Pose pose\n"
                                            "bool billboard\n"
                                            "float64 font_size\n"
                                            "bool scale_invariant\n"
                                            "foxglove_msgs/Color color\n"
                                            "string text" POLYGMAP_MSG("foxglove_msgs/ModelPrimitive")
                                                "geometry_msgs/Pose pose\n"
                                                "geometry_msgs/Vector3 scale\n"
                                                "foxglove_msgs/Color color\n"
                                                "bool override_color\n"
                                                "string url\n"
                                                "string media_type\n"
                                                "uint8[] data" POLYGMAP_COLOR POLYGMAP_POSE POLYGMAP_POINT
                                                    POLYGMAP_QUATERNION POLYGMAP_VECTOR3;

constexpr char kParameters[] =
    "# Every parameter's value as a parameter file has it, and their hash.\n"
    "string hash\n"
    "string[] name\n"
    "string[] value\n"
    "# The same, exactly, with the schedule and the camera: for a replay.\n"
    "uint8[] header";
constexpr char kReplay[] =
    "# One frame of a lane: firmware/recording/stream/format.hpp.\n"
    "uint8[] records";
constexpr char kJointGains[] =
    "std_msgs/Header header\n"
    "string[] name\n"
    "float64[] kp_nmprad\n"
    "float64[] kd_nmsprad" POLYGMAP_HEADER;
constexpr char kGait[] =
    "std_msgs/Header header\n"
    "string phase\n"
    "string module_state\n"
    "string stop_reason\n"
    "# The rise or tread behind stop_reason.\n"
    "float64 stop_measured_m\n"
    "uint32 treads_climbed\n"
    "# Counts swings from 1.\n"
    "uint32 step\n"
    "# Left, right: the planned contact, the estimated one, and the soles' poses in the header's frame.\n"
    "bool[2] stands\n"
    "float64[2] contact_probability\n"
    "geometry_msgs/Pose[2] sole_desired\n"
    "geometry_msgs/Pose[2] sole\n"
    "geometry_msgs/Point com_desired" POLYGMAP_HEADER POLYGMAP_POSE POLYGMAP_POINT POLYGMAP_QUATERNION;
constexpr char kFrame[] =
    "std_msgs/Header header\n"
    "uint8 lane\n"
    "uint64 cycle\n"
    "# The lane's rows of the schedule: called; given up for lack of time; paying back; longer than their budget.\n"
    "string[] row\n"
    "bool[] ran\n"
    "bool[] shed\n"
    "bool[] deferred\n"
    "bool[] overran\n"
    "# Spent by a resumable row, 100 instructions each.\n"
    "int32[] work_units\n"
    "bool overrun\n"
    "bool caught_up\n"
    "uint64 skipped_before" POLYGMAP_HEADER;
constexpr char kFaults[] =
    "# Faults and limits that were raised so far, with how often and when first and last.\n"
    "std_msgs/Header header\n"
    "string[] name\n"
    "uint32[] count\n"
    "int64[] first_ns\n"
    "int64[] last_ns" POLYGMAP_HEADER;
constexpr char kVerdict[] =
    "# summary.json, as polygmap climb writes it.\n"
    "string json";

#undef POLYGMAP_COLOR
#undef POLYGMAP_POSE
#undef POLYGMAP_HEADER
#undef POLYGMAP_QUATERNION
#undef POLYGMAP_POINT
#undef POLYGMAP_VECTOR3
#undef POLYGMAP_MSG

constexpr std::array<mcap::Channel, kTopicCount> kChannels{{
    {"/parameters", "polygmap_msgs/msg/Parameters", kParameters},
    {"/replay", "polygmap_msgs/msg/Replay", kReplay},
    {"/imu", "sensor_msgs/msg/Imu", kImu},
    {"/joints", "sensor_msgs/msg/JointState", kJointState},
    {"/feet", "geometry_msgs/msg/WrenchStamped", kWrenchStamped},
    {"/lio", "nav_msgs/msg/Odometry", kOdometry},
    {"/depth", "sensor_msgs/msg/Image", kImage},
    {"/camera_info", "sensor_msgs/msg/CameraInfo", kCameraInfo},
    {"/commands", "sensor_msgs/msg/JointState", kJointState},
    {"/gains", "polygmap_msgs/msg/JointGains", kJointGains},
    {"/odometry", "nav_msgs/msg/Odometry", kOdometry},
    {"/tf", "tf2_msgs/msg/TFMessage", kTfMessage},
    {"/surfaces", "foxglove_msgs/msg/SceneUpdate", kSceneUpdate},
    {"/map", "foxglove_msgs/msg/SceneUpdate", kSceneUpdate},
    {"/footholds", "foxglove_msgs/msg/SceneUpdate", kSceneUpdate},
    {"/gait", "polygmap_msgs/msg/Gait", kGait},
    {"/frame", "polygmap_msgs/msg/Frame", kFrame},
    {"/faults", "polygmap_msgs/msg/Faults", kFaults},
    {"/truth", "nav_msgs/msg/Odometry", kOdometry},
    {"/truth_feet", "geometry_msgs/msg/PoseArray", kPoseArray},
    {"/stairs", "foxglove_msgs/msg/SceneUpdate", kSceneUpdate},
    {"/preview", "sensor_msgs/msg/CompressedImage", kCompressedImage},
    {"/verdict", "polygmap_msgs/msg/Verdict", kVerdict},
}};

}  // namespace

const std::array<mcap::Channel, kTopicCount>& channels() noexcept { return kChannels; }

}  // namespace polygmap::recording
