% One morning of the robot of library.al.

initially at(porter, office), battery(porter, 3), open(glass_door).
initially lies_in(night_train, office).

hpd(go(porter, library), 0).
hpd(take(porter, logic_textbook), 1).
hpd(go(porter, office), 2).

% It did not arrive, and it still holds the book.
obs(at(porter, library), true, 3).
obs(carries(porter, logic_textbook), true, 3).
obs(quiet(library), true, 0).
