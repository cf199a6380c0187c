#include <cstdio>
#include <cstdlib>
#include "tests/support/bus_climb.hpp"
using namespace polygmap; using namespace polygmap::sim;
// trace BUS ds|ss seed swing share(<0: both) stance|swing joint|bus0/1
int main(int c,char**v){
  BusClimb::Options o; o.bus_file=v[1]; o.pattern=v[2][0]=='s'?GaitPattern::kSingleStep:GaitPattern::kDoubleStep; o.seed=atoi(v[3]);
  std::vector<SwingTimes> s; { BusClimb r(o); s=swings_of(r); }
  std::size_t n=atoi(v[4]); double share=atof(v[5]);
  double at = share>=0? s[n].lift_off_s+share*(s[n].touch_down_s-s[n].lift_off_s) : s[n-1].touch_down_s - share*(s[n].lift_off_s-s[n-1].touch_down_s);
  Foot leg = v[6][1]=='t'?other(s[n].foot):s[n].foot;
  Mute m; if(v[7][0]=='b') m={true,2*index_of(leg)+(std::size_t)(v[7][1]-'0')}; else m={false,joint_index(leg,atoi(v[7]))};
  BusClimb climb(o); climb.run_until(at); climb.set_mute(m,true);
  std::printf("swing leg %d, T=%.2f\n", (int)index_of(s[n].foot), s[n].touch_down_s-s[n].lift_off_s);
  double last=-1;
  int N = c>8?atoi(v[8]):1250; int every=c>9?atoi(v[9]):25;
  for(int i=0;i<N;++i){ climb.tick(); if(i%every) continue; const Truth&t=climb.truth(); const GaitStatus&g=climb.status();
    const Mat3&R=t.true_T_base.R; double pitch=std::atan2(-R(2,0),R(2,2)), roll=std::atan2(R(2,1),R(2,2));
    Vec3 st=t.true_T_sole[1-index_of(s[n].foot)].inverse()*t.true_p_com_m; 
    const StateEstimate&e=climb.control().state(); Vec3 ep=e.odom_T_sole[1-index_of(s[n].foot)].inverse()*e.odom_T_base.p_m; Vec3 tp=t.true_T_sole[1-index_of(s[n].foot)].inverse()*t.true_T_base.p_m;
    std::printf("%.3f ph=%d stands=%d%d con=%d%d F=%.2f pitch=%5.1f roll=%5.1f com/stance=(%.3f %.3f) base est-true=(%.3f %.3f %.3f) soles z=(%.3f %.3f) des z sw=%.3f swx=%.3f pitchsw=%.1f pitchst=%.1f %s\n",
     climb.time_s()-at,(int)g.phase,g.stands[0],g.stands[1],t.in_contact[0],t.in_contact[1],t.load_share[0],pitch*57.3,roll*57.3,st.x(),st.y(),ep.x()-tp.x(),ep.y()-tp.y(),ep.z()-tp.z(),t.true_T_sole[0].p_m.z(),t.true_T_sole[1].p_m.z(),g.odom_T_sole_desired[index_of(s[n].foot)].p_m.z(),
     (t.true_T_sole[0].p_m-t.true_T_sole[1].p_m).x(), std::atan2(-t.true_T_sole[index_of(s[n].foot)].R(2,0),t.true_T_sole[index_of(s[n].foot)].R(2,2))*57.3,std::atan2(-t.true_T_sole[1-index_of(s[n].foot)].R(2,0),t.true_T_sole[1-index_of(s[n].foot)].R(2,2))*57.3,t.fall_reason.c_str());
    if(t.fell)break; }
}
