% A robot brought a parcel from the hall to the office. Later the parcel is not there. What happened?
% Written in SPARC; docs/sparc.md describes the language.

#const n = 3.

sorts
#place = {hall, office, lab}.
#parcel = {parcel, letter}.
#robot = {porter}.
#thing = #parcel + #robot.
#step = 0..n.
#fluent = loc(#thing, #place) + in_hand(#robot, #parcel).
#action = go(#robot, #place) + put_down(#robot, #parcel).
#event = take_away(#parcel, #place).

predicates
holds(#fluent, #step).
occurs(#action, #step).
happened(#event, #step).
sees(#thing, #place, #step).
misses(#thing, #place, #step).

rules
% What the robot does, and what somebody may have done.
holds(loc(R, P), I + 1) :- occurs(go(R, P), I).
-holds(in_hand(R, T), I + 1) :- occurs(put_down(R, T), I).
holds(loc(T, P), I + 1) :- happened(take_away(T, P), I).
:- happened(take_away(T, P), I), holds(loc(T, P), I).
:- happened(take_away(T, P), I), holds(in_hand(R, T), I).

% What is in the hand goes where the robot goes; everything is in one place.
holds(loc(T, P), I) :- holds(in_hand(R, T), I), holds(loc(R, P), I).
-holds(loc(T, P), I) :- holds(loc(T, Q), I), P != Q.

% What does not change stays.
holds(F, I + 1) :- holds(F, I), not -holds(F, I + 1).
-holds(F, I + 1) :- -holds(F, I), not holds(F, I + 1).

% What was seen agrees with what is concluded.
:- sees(T, P, I), not holds(loc(T, P), I).
:- misses(T, P, I), holds(loc(T, P), I).

% Nobody takes anything away, unless nothing else explains what was seen.
somebody : happened(take_away(T, P), I) :+ I < n.

holds(loc(porter, hall), 0). holds(in_hand(porter, parcel), 0). holds(loc(letter, lab), 0).
occurs(go(porter, office), 0). occurs(put_down(porter, parcel), 1).
sees(porter, office, 1). sees(letter, lab, 3). misses(parcel, office, 3).

display
happened(E, I).
holds(loc(parcel, P), 3).
